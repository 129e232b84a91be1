#!/usr/bin/env python3
"""Kills the executive of the recharge mission at random moments, in real time, with the simulator in another process.

usage: durable_test.py SENTREE SOURCE_DIR WORK_DIR OTHER_BOOT [--processes] [KILLS [SEED]]

OTHER_BOOT is the library of other_boot.cpp. Missions follow each other until there were KILLS kills (default 6); after
every third kill the last write is torn, after every third the machine is another one to the program, with its clock set
back. Each mission must end with SUCCESS, and over the whole chain of its recordings each observation is there once, each
verdict too, and no goal was sent that the robot had. At last the disk is slow, and the run waits for each write: that is
told, and the mission goes on and is resumed as others are; then it fails, which is told; then it is full: that is told,
the mission goes on, and cannot be resumed.

--processes: skills and a monitor run in processes of their own. Killed is the executive, or the process of a skill, of
the monitor, of several, or all at once; what survived is found again, the monitor decides once and at the observation
at which it should, and when all is over nothing is left behind.
"""

import json
import os
import random
import re
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile

FACTOR = 20
# Violated by the fifth answer of a leaf that is asked in every mission: no more and no fewer may be observed.
COUNTED, COUNT = "WaitForUser.tick.reply", 5
MONITOR = """<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" initial="counts">
  <datamodel><data id="n" expr="0"/></datamodel>
  <state id="counts">
    <transition event="%s" cond="n &lt; %d"><assign location="n" expr="n + 1"/></transition>
    <transition event="%s" target="enough"/>
  </state>
  <state id="enough"/>
</scxml>
""" % (COUNTED, COUNT - 1, COUNTED)
KILLS_PER_MISSION = 6
INVALID = 3  # exit code


def say(text):
    print(text, flush=True)


class Failed(Exception):
    pass


class Test:
    def __init__(self, sentree, source, work, other_boot, in_processes, kills, seed):
        self.sentree, self.source, self.work = sentree, source, work
        self.in_processes, self.found_again, self.struck = in_processes, 0, {}
        self.kills, self.random = kills, random.Random(seed)
        self.other_boot = other_boot
        self.told_slow = False
        self.resumed = self.mishaps = self.torn = self.set_back = self.told_set_back = 0
        shutil.rmtree(work, ignore_errors=True)
        os.makedirs(work)
        self.socket = os.path.join(work, "robot.sock")
        self.environment = dict(os.environ, XDG_RUNTIME_DIR=work, SENTREE_RUNS=os.path.join(work, "runs"))
        self.scenario = os.path.join(work, "mission.yaml")
        with open(self.scenario, "w", encoding="utf-8") as file:
            file.write(f"""project: {source}/examples/recharge
clock: {{real: {FACTOR}}}
override:
  services: {{battery: {{at: "unix:{self.socket}"}}, navigation: {{at: "unix:{self.socket}"}}}}
  world: {{battery: {{initial: 40 %}}}}
{self.monitored("override")}  # The machine may be slow; the mission is not what is tested for speed here.
  deadlines: {{call: 2 s, condition: 4 s, budget: 5 s, unresponsive: 10 s}}
duration: 60 min
{self.monitored("processes")}""")

    def monitored(self, part):
        if not self.in_processes:
            return ""
        file = os.path.join(self.work, "users.scxml")
        with open(file, "w", encoding="utf-8") as chart:
            chart.write(MONITOR)
        if part == "override":
            return f'  monitors: [{{file: "{file}", violated: [enough], at: "{{watch}}"}}]\n'
        return 'processes: {watch: {monitor: users, listen: "unix:{run}/watch.sock", restarts: 5}}\n'

    def parts(self):
        """Process ids of the skills and monitors of this test, with what they are."""
        found = {}
        for pid in os.listdir("/proc"):
            try:
                with open(f"/proc/{pid}/cmdline", "rb") as file:
                    command = file.read().decode(errors="replace").split("\0")
            except OSError:
                continue
            if command[1:2] in (["skill"], ["monitor"]) and self.scenario in command:
                found[int(pid)] = command[3] if command[1] == "skill" else "monitor"
        return found

    def strike(self, run):
        """Kills something. Returns whether it was the executive."""
        each = ["executive", "skill", "all", "monitor", "executive", "several"]
        victims = each[sum(self.struck.values()) % len(each)] if self.in_processes else "executive"
        self.struck[victims] = self.struck.get(victims, 0) + 1
        before = self.parts() if self.in_processes else {}
        if victims in ("executive", "all"):
            run.send_signal(signal.SIGKILL)
        condemned = {"executive": [], "all": list(before)}.get(victims)
        if condemned is None:
            among = sorted(pid for pid, what in before.items() if victims == "several" or (what == "monitor") == (victims == "monitor"))
            condemned = self.random.sample(among, min(len(among), len(before) // 2 if victims == "several" else 1))
        for pid in condemned:
            os.kill(pid, signal.SIGKILL)
        if victims not in ("executive", "all"):
            return False
        run.wait()
        run.stdout.close()
        self.left = set(before) - set(condemned)
        return True

    def start(self, *arguments):
        # Signals stay ignored: a write beyond a file's limit is an error then.
        return subprocess.Popen([self.sentree, *arguments], cwd=self.work, env=self.environment, restore_signals=False,
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def simulator(self, seed):
        simulator = self.start("component", "sim", "--project", self.scenario, "--listen", f"unix:{self.socket}",
                               "--factor", str(FACTOR), "--seed", str(seed))
        for line in simulator.stdout:
            if line.startswith("listening on"):
                break
        shutil.rmtree(os.path.join(self.work, "runs"), ignore_errors=True)
        return simulator

    def mishap(self):
        """What else befalls the machine when the executive is killed."""
        self.mishaps += 1
        if self.mishaps % 3 == 1:
            self.tear()
        elif self.mishaps % 3 == 2:
            self.set_clock_back()

    def journals(self):
        runs = os.path.join(self.work, "runs")
        names = os.listdir(runs) if os.path.isdir(runs) else []
        return [os.path.join(runs, name) for name in names if name.endswith(".journal")]

    def tear(self):
        """The executive died while it wrote a record."""
        for path in self.journals():
            with open(path, "r+b") as file:
                if file.read(25)[-1:] != b"o":  # of a run that was resumed already
                    continue
                file.seek(0, os.SEEK_END)
                size = self.random.randrange(1, 4000)
                file.write((struct.pack("<QB", 4000, 3) + self.random.randbytes(4000))[:size])
                self.torn += 1

    def set_clock_back(self):
        self.set_back += 1
        boot = os.path.join(self.work, "boot")
        with open(boot, "w", encoding="utf-8") as file:
            file.write(f"boot-{self.set_back}\n")
        self.environment.update(LD_PRELOAD=self.other_boot, SENTREE_TEST_BOOT=boot,
                                SENTREE_TEST_SET_BACK_S=str(3600 * self.set_back))

    def ask(self, service, interface, method, *arguments):
        command = [self.sentree, "call", f"unix:{self.socket}#{service}", method, *arguments, "--interface",
                   f"robot.thrift/{interface}"]
        done = subprocess.run(command, cwd=self.work, env=self.environment, stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, timeout=60, check=False)
        if done.returncode != 0:
            raise Failed(f"{' '.join(command)}: {done.stderr}")
        return json.loads(done.stdout)

    def navigation(self):
        return self.ask("navigation", "Navigation", "getNavigationState")

    def drives_on(self):
        """With nobody there: the robot goes on to its goal. False: it does not drive now."""
        before = self.navigation()
        if before["status"] != "MOVING":
            return False
        while True:
            now = self.navigation()
            if now["goal_id"] != before["goal_id"]:
                raise Failed(f"another goal took over while nobody was there: {now}")
            if now["status"] != "MOVING" or now["distance_remaining"] < before["distance_remaining"] - 0.05:
                return True

    def mission(self, number, kills):
        """One mission with so many kills. Returns how many of them happened before its end, and whether the robot was seen to drive on."""
        simulator = self.simulator(number)
        run = None
        try:
            killed, driven, resumes = 0, False, False
            run = self.start("run", self.scenario, "--durable", "--verbose",
                             *(["--processes"] if self.in_processes else []))
            while True:
                # A moment is a number of lines that the run has printed, so that slow machines are killed alike; as
                # often among the first hundred as among the last thousands. Every other one comes once the run has gone on.
                until = int(8000 ** self.random.random()) if killed < kills else None
                code, text, plugged = self.follow(run, until, goes_on=resumes and killed % 2 == 1)
                resumes = False
                if code == INVALID and killed and self.is_over(text):
                    # It was killed when all had been said.
                    code, text = 0, self.last_words()
                if code is not None:
                    break
                # Before that there is nothing to resume.
                while not self.journals() and run.poll() is None:
                    pass
                killed += 1
                if not self.strike(run):
                    continue
                self.mishap()
                if not driven:
                    driven = self.drives_on()
                survivors = self.left if self.in_processes else set()
                run, resumes = self.start("run", "--resume", "--verbose"), True
                if survivors:
                    self.found_again += survivors <= set(self.parts())
            if code not in (0, 1) or "mission SUCCESS" not in text:
                raise Failed(f"mission {number} with {killed} kills exited with {code}:\n{text}")
            self.judge(number, killed, text)
            return killed, driven
        finally:
            for process in (run, simulator):
                if process is not None and process.poll() is None:
                    process.kill()
                    process.wait()
            for pid in self.parts():
                os.kill(pid, signal.SIGKILL)

    @staticmethod
    def is_over(text):
        return "this run has ended" in text or "was resumed already" in text or "waits to be resumed" in text

    def last_words(self):
        """What the recording with the end says of it."""
        for name in os.listdir(os.path.join(self.work, "runs")):
            if name.endswith(".mcap") and "sentree.result" in self.info(name)["metadata"]:
                return subprocess.run([self.sentree, "info", f"runs/{name}"], cwd=self.work, env=self.environment,
                                      capture_output=True, text=True, timeout=60, check=True).stdout
        return ""

    def slow_disk(self):
        """A mission that waits for a slow disk before each call, and is killed once."""
        simulator = self.simulator(1)
        self.environment.update(LD_PRELOAD=self.other_boot, SENTREE_TEST_SYNC_MS="20")
        run = self.start("run", self.scenario, "--durable=each", "--verbose")
        try:
            for killed in (0, 1):
                self.told_slow = False
                code, text, _ = self.follow(run, None if killed else 2000)
                if not self.told_slow:
                    raise Failed(f"nothing was told of the slow disk, killed {killed} times:\n{text}")
                if not killed:
                    run.send_signal(signal.SIGKILL)
                    run.wait()
                    run.stdout.close()
                    run = self.start("run", "--resume", "--verbose")
            if code not in (0, 1) or "mission SUCCESS" not in text:
                raise Failed(f"the mission on the slow disk exited with {code}:\n{text}")
            self.judge(0, 1, text)
        finally:
            del self.environment["SENTREE_TEST_SYNC_MS"]
            for process in (run, simulator):
                if process.poll() is None:
                    process.kill()
                    process.wait()

    def failing_disk(self):
        """A mission whose disk takes the journal at first, and then says that it does not."""
        simulator = self.simulator(1)
        self.environment.update(LD_PRELOAD=self.other_boot, SENTREE_TEST_SYNCS="2")
        run = self.start("run", self.scenario, "--durable", "--verbose")
        try:
            for line in run.stdout:
                if "journal cannot be written" in line:
                    break
            else:
                raise Failed("nothing was told of the disk that fails")
            if "Input/output error" not in line:
                raise Failed(f"of the disk that fails was told: {line}")
            say("✓ a disk that fails behind the run: told")
        finally:
            del self.environment["SENTREE_TEST_SYNCS"]
            for process in (run, simulator):
                if process.poll() is None:
                    process.kill()
                    process.wait()

    def full_disk(self, is_killed):
        """A mission on whose disk there is no more room from some moment on, which then is killed or ends."""
        simulator = self.simulator(1)
        run = self.start("run", self.scenario, "--durable", "--verbose")
        try:
            code, text, _ = self.follow(run, int(8000 ** self.random.random()))
            if code is not None:
                raise Failed(f"the mission ended with {code} before the disk was full:\n{text}")
            resource.prlimit(run.pid, resource.RLIMIT_FSIZE, (512, resource.RLIM_INFINITY))
            told = ""
            for line in run.stdout:
                told += line if "journal cannot be written" in line else ""
                if told:
                    break
            if "File too large" not in told:
                raise Failed(f"nothing was told of the full disk, but {told!r}")
            if is_killed:
                run.send_signal(signal.SIGKILL)
                run.wait()
                run.stdout.close()
                run = self.start("run", "--resume")
                text, _ = run.communicate(timeout=120)
                if run.returncode == 0 or "cannot be resumed" not in text or "File too large" not in text:
                    raise Failed(f"resumed with {run.returncode}, where the disk was full:\n{text}")
            else:
                code, text, _ = self.follow(run, None)
                if code not in (0, 1) or "mission SUCCESS" not in text:
                    raise Failed(f"the mission on the full disk exited with {code}:\n{text}")
            say(f"✓ full disk: told, and {'not resumed' if is_killed else 'the mission ended with SUCCESS'}")
        finally:
            for process in (run, simulator):
                if process.poll() is None:
                    process.kill()
                    process.wait()

    def follow(self, run, until, goes_on=False):
        """Reads what the run prints, and plugs the robot in when it waits for that. (None, …): it has printed so many lines,
        of which only those count that follow its going on, if that is to be waited for."""
        lines, tail, plugged = 0, [], False
        for line in run.stdout:
            goes_on = goes_on and "mission.resumed" not in line
            lines += not goes_on
            tail = tail[-60:] + [line]
            self.told_set_back += "the machine's clock was set back" in line
            self.told_slow = self.told_slow or "does not keep up with its journal: the disk takes 2" in line
            if not plugged and "WaitForUser.tick.reply" in line:
                plugged = self.ask("simulation", "Simulation", "plugIn") == "OK"
            if until is not None and lines >= until:
                return None, "", plugged
        return run.wait(), "".join(tail), plugged

    def judge(self, number, killed, text):
        # From the one that ended backwards. A run that was killed before it went on is not of the chain.
        facts = {name: self.info(name)["metadata"] for name in os.listdir(os.path.join(self.work, "runs"))
                 if name.endswith(".mcap")}
        ended = [name for name, fact in facts.items() if fact.get("sentree.result", {}).get("mission") == "SUCCESS"]
        if len(ended) != 1:
            raise Failed(f"mission {number}: ended in {ended}")
        order = ended
        while before := facts[order[0]]["sentree.run"].get("continues"):
            order.insert(0, before)
        expected, goals, asked, violations, resumed = 1, [], set(), [], 0
        counted, decided, errands = [], [], 0
        for name in order:
            for topic, message in self.messages(name):
                if topic == "/violations":
                    violations.append(message["monitor"])
                    if message["monitor"] == "users":
                        decided.append(message["sequence"])
                if topic != "/observations":
                    continue
                if message["sequence"] != expected:
                    raise Failed(f"mission {number}: in {name} observation {message['sequence']} follows {expected - 1}")
                expected += 1
                resumed += message["name"] == "mission.resumed"
                if message["name"] == "node.status" and message["source"] in ("GoToKitchen", "GoToStation"):
                    errands += message["data"]["from"] == "IDLE"
                if message["name"] == COUNTED:
                    counted.append(message["sequence"])
                if message["name"] == "navigation.gotoTargetByLocationName.request":
                    asked.add(message["call"])
                if message["name"] == "navigation.gotoTargetByLocationName.reply":
                    goals.append(message["data"]["result"]["goal_id"])
        self.resumed += resumed
        if resumed != len(order) - 1 or resumed > killed:
            raise Failed(f"mission {number}: resumed {resumed} times, killed {killed} times, recorded in {order}")
        violated = re.findall(r"✗ monitor (\w+): violated", text)
        if sorted(violations) != sorted(violated):
            raise Failed(f"mission {number}: recorded violations {violations}, in the end {violated}")
        if self.in_processes and decided != counted[COUNT - 1:COUNT]:
            raise Failed(f"mission {number}: the monitor in another process decided at {decided}, not at {counted[:COUNT]}")
        if len(goals) != len(set(goals)):
            raise Failed(f"mission {number}: one goal was given twice: {goals}")
        # To the kitchen, to the station, and to the kitchen again; but a robot that nobody watched for long may be in the
        # kitchen already. Whatever was killed in between, each errand has one goal, which the robot counts, or none, if it
        # was over before anybody knew whether the robot has it.
        given = self.navigation()["goal_id"]
        if not len(goals) <= given <= errands:
            raise Failed(f"mission {number}: the robot was given {given} goals for {errands} errands; replies: {goals}")
        left = [name for name in os.listdir(os.path.join(self.work, "runs")) if not name.endswith((".mcap", ".journal"))]
        left += self.parts().values() if self.in_processes else []
        if left:
            raise Failed(f"mission {number}: {left} was left behind")
        say(f"✓ mission {number}: {killed} kills, {expected - 1} observations, {given} goals, violated: {violated or 'nothing'}")

    def info(self, name):
        if os.path.getsize(os.path.join(self.work, "runs", name)) == 0:
            return {"metadata": {}, "messages": 0}  # killed before it wrote a byte
        done = subprocess.run([self.sentree, "info", f"runs/{name}", "--json"], cwd=self.work, env=self.environment,
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60, check=True)
        return json.loads(done.stdout)

    def messages(self, name):
        if self.info(name)["messages"] == 0:
            return  # killed in its first half second
        done = subprocess.run([self.sentree, "export", f"runs/{name}", "--to", "ndjson"], cwd=self.work,
                              env=self.environment, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              timeout=120, check=True)
        for line in done.stdout.splitlines():
            entry = json.loads(line)
            yield entry["topic"], entry.get("message", entry.get("data"))

    def run(self):
        left, number, driven = self.kills, 0, False
        while left > 0:
            number += 1
            if number > 3 * self.kills:
                raise Failed("missions end before they can be killed")
            killed, drove = self.mission(number, min(left, KILLS_PER_MISSION))
            left -= killed
            driven = driven or drove
        # Some are killed before they have gone on; were it most, nothing would be tested.
        killed = self.struck.get("executive", 0) + self.struck.get("all", 0)
        if self.resumed * 3 < killed:
            raise Failed(f"only {self.resumed} of {killed} kills came after the run had gone on")
        if not driven and not self.in_processes:
            raise Failed("the robot was never seen to drive on while nobody was there")
        if self.torn == 0 or self.told_set_back == 0:
            raise Failed(f"writes torn: {self.torn}, clock set back: {self.set_back}, told: {self.told_set_back}")
        if self.in_processes:
            say(f"struck: {self.struck}; all that survived was there {self.found_again} times")
            return
        self.slow_disk()
        self.failing_disk()
        for is_killed in (True, False):
            self.full_disk(is_killed)


def main():
    arguments = [argument for argument in sys.argv[1:] if argument != "--processes"]
    in_processes = len(arguments) < len(sys.argv) - 1
    sentree, source, work, other_boot = (os.path.abspath(path) for path in arguments[:4])
    kills = int(arguments[4]) if len(arguments) > 4 else 6
    seed = int(arguments[5]) if len(arguments) > 5 else 20
    say(f"{kills} kills, seed {seed}")
    # Sockets want short names.
    with tempfile.TemporaryDirectory(prefix="sentree-") as short:
        try:
            Test(sentree, source, short if in_processes else work, other_boot, in_processes, kills, seed).run()
        except Failed as failure:
            say(f"✗ seed {seed}: {failure}")
            if in_processes:
                shutil.rmtree(work, ignore_errors=True)
                shutil.copytree(os.path.join(short, "runs"), work, ignore=lambda _, names: [n for n in names if n.endswith(".parts")])
                say(f"what was recorded is in {work}")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
