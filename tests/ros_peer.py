#!/usr/bin/env python3
"""Sentree in a graph of ROS 2, from outside: a simulated robot in one process, commands and missions in others.

usage: ros_peer.py SENTREE SOURCE_DIR WORK_DIR
Exit code 77: this build has no DDS.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import threading

from mission_elsewhere import check_verdicts

PATIENCE = 120
sentree, source, work = (os.path.abspath(path) for path in sys.argv[1:4])
shutil.rmtree(work, ignore_errors=True)
os.makedirs(work + "/run")
os.chdir(work)
os.symlink(source + "/examples", "examples")
domain = str(1 + os.getpid() % 100)
environment = {**os.environ, "ROS_DOMAIN_ID": domain, "XDG_RUNTIME_DIR": work + "/run", "SENTREE_RUNS": ""}
for name in ("ROS_LOCALHOST_ONLY", "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_DISTRO", "AMENT_PREFIX_PATH"):
    environment.pop(name, None)
failures = 0


def check(what, good, more=""):
    global failures
    print(("ok   " if good else "FAIL ") + what + ("" if good else "\n" + str(more)), flush=True)
    failures += not good


def run(*arguments):
    done = subprocess.run([sentree, *arguments], stdin=subprocess.DEVNULL, capture_output=True, text=True, env=environment,
                          timeout=5 * PATIENCE)
    return done.returncode, done.stdout, done.stderr


class Program:
    """Runs until it is ended; waits until it has said `until`."""

    def __init__(self, *arguments, until):
        self.child = subprocess.Popen([sentree, *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                      stderr=subprocess.STDOUT, text=True, env=environment)
        self.said, self.ready = "", threading.Event()
        threading.Thread(target=self.read, args=(until,), daemon=True).start()
        check(" ".join(arguments[:2]) + " begins", self.ready.wait(PATIENCE), self.said)

    def read(self, until):
        for line in self.child.stdout:
            self.said += line
            if until in line:
                self.ready.set()

    def end(self):
        self.child.terminate()
        check("it ends when it is told to", self.child.wait(PATIENCE) is not None)


def simulated_robot():
    sim = Program("sim", "--world", "examples/recharge/world/world.yaml", "--ros", "--headless", until="listening on ros:/")
    code, out, err = run("services", "--on", "ros:", "--json")
    names = {each["name"]: each["kind"] for each in json.loads(out)}
    check("sentree services --on ros:", names.get("/battery/getBatteryCharge") == "service robot/srv/BatteryGetBatteryCharge",
          out + err)
    code, out, err = run("call", "ros:/simulation", "setBatteryCharge", "percent=12", "--interface", "robot.thrift/Simulation")
    check("a call with an enum", code == 0 and out == '"OK"\n', out + err)
    code, out, err = run("call", "ros:/battery", "getBatteryCharge", "--interface", "robot.thrift/Battery")
    check("it did so", code == 0 and 11 < float(out) <= 12, out + err)
    code, out, err = run("call", "ros:/nobody", "call", "--interface", "std_srvs/srv/Trigger")
    check("a service that is not there", code == 4 and "no server of /nobody" in err, err)
    code, out, err = run("call", "ros:/lamp", "call", "data=7", "--interface", "std_srvs/srv/SetBool")
    check("an argument of another type", code == 2 and "expected bool" in err, err)
    with open(source + "/docs/how-to/join-a-ros2-robot.md") as guide:
        told = re.findall(r"^\$ sentree ((?:services|ping|call|doctor).*?)\s*(?:#.*)?$", guide.read(), re.M)
    check("the guide has commands", len(told) == 4, told)
    for command in told:
        code, out, err = run(*shlex.split(command))
        check("the guide says: sentree " + command, code == 0, out + err)
    check("sentree doctor says the domain", "ROS 2 by Fast DDS" in out and "domain " + domain in out, out)
    sim.end()


def topics():
    """What others publish is a topic of the mission, and what the mission publishes is read by others."""
    shutil.copytree(source + "/examples/topics", "topics")
    with open("topics/scenarios/ros.yaml", "w") as out:
        out.write("""description: a battery elsewhere drains
clock: real
override:
  services:
    battery: {at: "ros:/elsewhere/battery"}
duration: 5 min
expect: {mission: SUCCESS}
""")
    interface = re.search(r"battery:.*interface:\s*([\w./]+)", open("topics/sentree.yaml").read()).group(1)
    if not os.path.exists(interface.rsplit("/", 1)[0]):
        interface = "topics/interfaces/" + interface
    mission = subprocess.Popen([sentree, "run", "topics", "--scenario", "ros", "--no-record"], stdin=subprocess.DEVNULL,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)
    reader = threading.Thread(target=mission.communicate, daemon=True)
    reader.start()
    percentages = iter([80, 50, 12.5] + 500 * [12.5])
    while mission.poll() is None and (percentage := next(percentages, None)) is not None:
        run("call", "ros:/elsewhere/battery?publish", "state", "percentage=%s" % percentage, "charging=false",
            "--interface", interface)
    reader.join(PATIENCE)
    check("the mission hears what it waits for", mission.poll() == 0, mission.poll())
    if mission.poll() is None:
        mission.kill()


if __name__ == "__main__":
    _, told, _ = run("doctor")
    if "ROS 2 by Fast DDS" not in told:
        print("skipped: this build has no DDS")
        sys.exit(77)
    simulated_robot()
    check_verdicts(run, check, source, "ros:/robot/", "ros:/goto", "ros:/level")
    topics()
    print("all good" if failures == 0 else "%d failures" % failures)
    sys.exit(failures != 0)
