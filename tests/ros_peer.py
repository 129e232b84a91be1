#!/usr/bin/env python3
"""Sentree in a graph of ROS 2, from outside: a simulated robot in one process, commands and missions in others.

usage: ros_peer.py SENTREE SOURCE_DIR WORK_DIR [PART…]
Exit code 77: this build has no DDS.
"""

import json
import math
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time

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


def complete_until(wanted, *words):
    """What is completed, once `wanted` is among it: nobody who presses Tab waits longer than discovery may take beside other work."""
    for _ in range(10):
        _, said, err = run("__complete", *words)
        if wanted in said:
            break
    return said, err


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
    # On a full machine discovery may take longer than what is published waits for readers.
    for _ in range(10):
        code, out, err = run("call", "ros:/cmd_vel?publish", "message", "--interface", "sensor_msgs/msg/BatteryState")
        if "differ" in err:
            break
    check("who publishes is told of another type", "the types of /cmd_vel differ: it is sensor_msgs/msg/BatteryState here" in err, out + err)
    code, out, err = run("call", "ros:/lamp", "call", "data=7", "--interface", "std_srvs/srv/SetBool")
    check("an argument of another type", code == 2 and "expected bool" in err, err)
    code, out, err = run("call", "ros:/nobody/set_parameters", "call", 'parameters=[{"name":"max_vel","value":{"type":3,"double_value":0.3}}]',
                         "--interface", "rcl_interfaces/srv/SetParameters")
    check("the services of parameters are known", code == 4 and "no server of /nobody/set_parameters" in err, out + err)
    with open(source + "/docs/how-to/join-a-ros2-robot.md") as guide:
        told = re.findall(r"^\$ sentree ((?:services|ping|call|doctor).*?)\s*(?:#.*)?$", guide.read(), re.M)
    check("the guide has commands", len(told) == 4, told)
    for command in told:
        # On a full machine discovery may take longer than the command waits.
        end = time.monotonic() + PATIENCE
        code, out, err = run(*shlex.split(command))
        while code != 0 and time.monotonic() < end:
            code, out, err = run(*shlex.split(command))
        check("the guide says: sentree " + command, code == 0, out + err)
    words, err = complete_until("ros:/battery/getBatteryCharge\t", "call", "ros:")
    check("completion of calls", "ros:/battery/getBatteryCharge\t" in words, words + err)
    words, err = complete_until("ros:/battery_state\t", "echo", "ros:")
    check("completion of what can be heard", "ros:/battery_state\t" in words and "getBatteryCharge" not in words, words + err)
    check("sentree doctor says the domain", "ROS 2 by Fast DDS" in out and "domain " + domain in out, out)
    sim.end()


def place_on_map():
    code, out, err = run("echo", "ros:/amcl_pose", "-n", "1", "--json")
    place = json.loads(json.loads(out)["text"])["pose"]["pose"]["position"]
    return place["x"], place["y"]


def goal_by_hand():
    """`sentree call` waits for what becomes of a goal, and cancels it when it is interrupted."""
    sim = Program("sim", "--world", "examples/recharge/world/world.yaml", "--ros", "--headless", until="listening on ros:/")
    spin = ("call", "ros:/spin", "send_goal", "--interface", "nav2_msgs/action/Spin", "--deadline", "20 s")
    code, out, err = run(*spin, "target_yaw=0.3", "--feedback")
    check("a goal is waited for", code == 0 and '"status":"SUCCEEDED"' in out.splitlines()[-1] and "was accepted" in err, out + err)
    child = subprocess.Popen([sentree, *spin, "target_yaw=6.2"], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                             stderr=subprocess.PIPE, text=True, env=environment)
    for line in child.stderr:
        if "was accepted" in line:
            child.send_signal(signal.SIGINT)
            break
    out, err = child.communicate(timeout=PATIENCE)
    check("Ctrl-C cancels it", child.returncode == 130 and '"status":"CANCELED"' in out, (child.returncode, out, err))
    code, out, err = run("call", "ros:/spin", "send_goal", "--deadline", "20 s", "target_yaw=0.3", "--feedback")
    check("its type is discovered", code == 0 and '"SUCCEEDED"' in out, out + err)
    turned = [float(each) for each in re.findall(r'"angular_distance_traveled":([-0-9.e]+)', out)]
    check("feedback of a spin", not turned or max(turned) > 0.05, out)
    code, out, err = run("call", "ros:/spin", "send_goal", "target_yaw=50", "time_allowance={sec: 1, nanosec: 0}", "--feedback",
                         "--interface", "nav2_msgs/action/Spin", "--deadline", "20 s")
    turned = [float(each) for each in re.findall(r'"angular_distance_traveled":([-0-9.e]+)', out)]
    check("a goal ends when its time is over", '"status":"ABORTED"' in out.splitlines()[-1], out + err)
    check("its feedback says how far it came", max(turned, default=0) > 0.1, out + err)
    code, out, err = run("call", "ros:/backup", "send_goal", "target={x: 0.2, y: 0, z: 0}", "speed=0.05", "--feedback",
                         "--interface", "nav2_msgs/action/BackUp", "--deadline", "30 s")
    moved = [float(each) for each in re.findall(r'"distance_traveled":([-0-9.e]+)', out)]
    took = re.search(r'"sec":(\d+)', out.splitlines()[-1])
    check("it backs up as fast as it is told", '"SUCCEEDED"' in out and took and int(took.group(1)) >= 3, out + err)
    check("its feedback is where it is", 0.05 < max(moved, default=0) < 0.25, out + err)
    x, y = place_on_map()
    pose = "{header: {stamp: {sec: 0, nanosec: 0}, frame_id: %s}, pose: {position: {x: %s, y: 0, z: 0}, orientation: {x: 0, y: 0, z: 0, w: 1}}}"
    goes = ("call", "ros:/navigate_to_pose", "send_goal", "--interface", "nav2_msgs/action/NavigateToPose", "--deadline", "40 s")
    code, out, err = run(*goes, "pose=" + pose % ("base_link", 0.4))
    there = place_on_map()
    check("a pose before the robot", '"SUCCEEDED"' in out and 0.2 < math.dist((x, y), there) < 0.6, (x, y, there, out, err))
    code, out, err = run(*goes, "pose=" + pose % ("camera", 0.4))
    check("a frame that is not known", '"status":"ABORTED"' in out and math.dist(place_on_map(), there) < 0.1, out + err)
    code, out, err = run("call", "ros:/compute_path_to_pose", "send_goal", "--interface", "nav2_msgs/action/ComputePathToPose",
                         "goal=" + pose % ("base_link", 0.5), "--deadline", "20 s")
    check("a plan from the robot", '"SUCCEEDED"' in out and '"poses":[{' in out, out[:500] + err)
    for place in ("goal=" + pose % ("nowhere", 1), "start=" + pose % ("nowhere", 1)):
        code, out, err = run("call", "ros:/compute_path_to_pose", "send_goal", "--interface", "nav2_msgs/action/ComputePathToPose",
                             place, "use_start=true", "--deadline", "20 s")
        check("a plan in a frame that is not known", '"status":"ABORTED"' in out, out[:500] + err)
    code, out, err = run("call", "ros:/follow_path", "send_goal", "--interface", "nav2_msgs/action/FollowPath",
                         "path={header: {stamp: {sec: 0, nanosec: 0}, frame_id: nowhere}, poses: [%s]}" % (pose % ("map", 1)),
                         "--deadline", "20 s")
    check("a path in a frame that is not known", '"status":"ABORTED"' in out, out + err)
    code, out, err = run("echo", "ros:/tf_static", "-n", "1")
    check("what was said before is echoed", code == 0 and "laser" in out, out + err)
    code, out, err = run("echo", "ros:/scan?qos=default", "-n", "1")
    check("the scan for readers that are reliable", code == 0 and "ranges" in out, out[:300] + err)
    code, out, err = run("call", "ros:/spin", "send_goal", "--interface", "nav2_msgs/action/Spinn")
    check("where an interface was looked for", code == 3 and "AMENT_PREFIX_PATH" in err, out + err)
    sim.end()


def what_is_only_heard():
    """What an action tells of its goals, and a topic that is read, are not called: by nobody, and nothing is cancelled by trying."""
    for method in ("feedback", "result", "status"):
        code, out, err = run("call", "ros:/navigate_to_pose", method, "--interface", "nav2_msgs/action/NavigateToPose")
        check("call refuses " + method, code == 2 and not out and "send_goal and cancel_goal are" in err, (code, out, err))
    code, out, err = run("call", "ros:/scan", "message", "--interface", "sensor_msgs/msg/LaserScan")
    check("call refuses a topic that is read", code == 2 and "write ros:/scan?publish to publish there" in err, (code, out, err))
    os.makedirs("heard/skills")
    with open("heard/sentree.yaml", "w") as out:
        out.write("mission: {file: mission.xml}\nservices:\n"
                  '  nav: {interface: nav2_msgs/action/NavigateToPose, at: "ros:/navigate_to_pose"}\n'
                  '  scan: {interface: sensor_msgs/msg/LaserScan, at: "ros:/scan"}\n'
                  '  level: {interface: sensor_msgs/msg/BatteryState, at: "yarp:/level:o"}\n')
    with open("heard/mission.xml", "w") as out:
        out.write('<root BTCPP_format="4"><BehaviorTree ID="M"><Action ID="Go"/></BehaviorTree></root>')
    with open("heard/skills/Go.scxml", "w") as out:
        out.write("""<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><state id="going">
  <onentry>
    <send type="thrift" target="nav" event="cancel_goal"/>
    <send type="thrift" target="nav" event="status"/>
    <send type="thrift" target="scan" event="message"/>
    <send type="thrift" target="level" event="message"/>
  </onentry>
  <transition event="nav.cancel_goal.reply" target="success"/> <transition event="halt" target="halted"/>
</state><final id="success"/><final id="halted"/></scxml>
""")
    code, out, err = run("check", "heard")
    check("check refuses what an action tells", code == 3 and "skills/Go.scxml:4:" in out and "nav.status: " in out, out + err)
    check("check refuses a topic that is read", "skills/Go.scxml:5:" in out and "scan.message: " in out and "?publish" in out, out + err)
    check("check refuses a port that is read", "skills/Go.scxml:6:" in out and "is read from" in out, out + err)
    check("check lets goals be cancelled", "skills/Go.scxml:3:" not in out, out + err)


def addresses():
    """What an address says beside its name, where it cannot be meant, is told with its line."""
    os.makedirs("addresses")
    with open("addresses/mission.xml", "w") as out:
        out.write('<root BTCPP_format="4"><BehaviorTree ID="M"><AlwaysSuccess/></BehaviorTree></root>')
    entries = [
        ("services", 'std_srvs/srv/SetBool, at: "ros:/lamp?publish"', "has publish, which is of topics"),
        ("services", 'nav2_msgs/action/Spin, at: "ros:/spin?qos=default"', "has qos=default, which is of topics"),
        ("services", 'std_srvs/srv/SetBool, at: "ros:/lamp?requests"', "stands under observe:"),
        ("services", 'std_msgs/msg/String, at: "ros:/text?requests"', "has requests, which services and actions have"),
        ("observe", 'std_msgs/msg/String, at: "ros:/text?requests"', "has requests, which services and actions have"),
        ("services", 'robot.thrift/Battery, at: "yarp:/battery:o"', "is a port that data are read from"),
        ("services", 'robot.thrift/Battery, at: "yarp:/battery?read"', "is a port that data are read from"),
        ("services", 'std_msgs/msg/String, at: "ros:/text?domain=1&domain=2"', "gives domain twice: domain=1 and domain=2"),
        ("services", 'std_msgs/msg/String, at: "ros:/text?range=localhost&range=subnet"', "gives range twice"),
        ("services", 'std_srvs/SetBool, at: "ros:/lamp"', 'there is no interface "std_srvs/SetBool"; did you mean "std_srvs/srv/SetBool"?'),
        ("services", 'std_srvs/Set, at: "ros:/lamp"', "or of ROS PACKAGE/msg/NAME, PACKAGE/srv/NAME"),
    ]
    for where, entry, told in entries:
        with open("addresses/sentree.yaml", "w") as out:
            out.write("mission: {file: mission.xml}\n%s:\n  it: {interface: %s}\n" % (where, entry))
        code, out, err = run("check", "addresses")
        check("check tells: " + entry, code == 3 and re.search(r"sentree\.yaml:3:\d+: .*" + re.escape(told), out), (code, out, err))
    code, out, err = run("call", "ros:/lamp", "call", "--interface", "std_srvs/SetBool")
    check("call tells how an interface is named", code == 3 and 'did you mean "std_srvs/srv/SetBool"?' in err, (code, out, err))
    environment["ROS_STATIC_PEERS"] = "10.0.0.5,10.0.0.6"
    code, out, err = run("doctor")
    check("doctor tells peers that cannot be read", "something other than a semicolon" in out, out + err)
    del environment["ROS_STATIC_PEERS"]


def topic_of_nobody():
    """A topic that nobody publishes is told, with what is near it, and in the end that nothing came of it."""
    os.makedirs("nobody/skills")
    with open("nobody/mission.xml", "w") as out:
        out.write('<root BTCPP_format="4"><BehaviorTree ID="M"><Action ID="Wait"/></BehaviorTree></root>')
    with open("nobody/skills/Wait.scxml", "w") as out:
        out.write('<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><state id="waiting">'
                  '<transition event="battery.message" target="success"/><transition event="halt" target="halted"/></state>'
                  '<final id="success"/><final id="halted"/></scxml>')

    def project(at):
        with open("nobody/sentree.yaml", "w") as out:
            out.write('mission: {file: mission.xml}\nservices: {battery: {interface: sensor_msgs/msg/BatteryState, at: "ros:%s"}}\n'
                      'skills: {Wait: {subscribe: [battery.message]}}\n' % at)

    project("/battery_state")
    with open("nobody/sentree.yaml", "a") as out:
        out.write('observe: {text: {interface: std_msgs/msg/String, at: "ros:/battery_state"}}\n')
    code, out, err = run("check", "nobody")
    check("two types at one name are an error", code == 3 and "/battery_state is of type " in out, out + err)
    project("/tf_static")
    with open("nobody/sentree.yaml") as project_file:
        text = project_file.read().replace("sensor_msgs/msg/BatteryState", "tf2_msgs/msg/TFMessage")
    with open("nobody/sentree.yaml", "w") as out:
        out.write(text)
    sim = Program("sim", "--world", "examples/recharge/world/world.yaml", "--ros", "--headless",
                  until="publishing as a robot")
    run("echo", "ros:/tf_static", "-n", "1")
    time.sleep(5)  # what is published at first waits for whoever is discovered meanwhile
    code, out, err = run("run", "nobody", "--no-record", "--duration", "20 s")
    check("what was said before is missed with a reason", "write ?qos=transient_local" in out + err, out + err)
    sim.end()
    environment["ROS_DISTRO"] = "jazzy"
    sim = Program("sim", "--world", "examples/recharge/world/world.yaml", "--ros", "--headless", until="publishing as a robot")
    check("files of another release are told", "is Humble's, and ROS_DISTRO is jazzy" in sim.said, sim.said)
    sim.end()
    del environment["ROS_DISTRO"]
    project("/battery_state?publish")
    code, out, err = run("check", "nobody")
    check("a topic of ours that nobody publishes is an error", code == 3 and "is where the project publishes" in out, out + err)
    code, out, err = run("services", "--on", "ros:")
    check("where nobody is, it is said where", code == 4 and "nobody offers anything in domain " + domain in err, out + err)
    sim = Program("sim", "--world", "examples/recharge/world/world.yaml", "--ros", "--headless", until="listening on ros:/")
    project("/battery_stat")
    with open("nobody/sentree.yaml", "a") as out:
        out.write('observe:\n  level: {interface: sensor_msgs/msg/BatteryState, at: "ros:/battery_sttate"}\n'
                  '  nav: {interface: nav2_msgs/action/NavigateToPose, at: "ros:/navigate_to_poes"}\n')
    code, out, err = run("run", "nobody", "--no-record", "--duration", "20 s")
    check("a topic that nobody publishes is told", 'nobody publishes ros:/battery_stat yet' in err and 'did you mean "/battery_state"?' in err,
          out + err)
    check("so is one that is observed", 'nobody publishes ros:/battery_sttate yet' in err and "nothing came of level from ros:/battery_sttate" in out + err,
          out + err)
    check("so is an action that is observed", 'nobody serves the action ros:/navigate_to_poes yet' in err and 'did you mean "/navigate_to_pose"?' in err,
          out + err)
    check("nothing came of it", "nothing came of battery from ros:/battery_stat" in out + err, out + err)
    sim.end()


POSE = "{header: {stamp: {sec: 0, nanosec: 0}, frame_id: 'map'}, pose: {position: {x: %s, y: %s, z: 0}, orientation: {x: 0, y: 0, z: 0, w: 1}}}"
# What each action of the robot is sent, and what its result must be.
ACTIONS = [
    ("compute_path_to_pose", "ComputePathToPose", {"goal": POSE % (14.6, 8.8), "use_start": "false"},
     "_event.data.result.path.poses.length &gt; 3"),
    ("spin", "Spin", {"target_yaw": "1.57"}, "_event.data.result.total_elapsed_time.sec &gt;= 1"),
    ("backup", "BackUp", {"target": "{x: 0.1, y: 0, z: 0}"}, "true"),
    ("navigate_to_pose", "NavigateToPose", {"pose": POSE % (2.0, 1.5)}, "true"),
    ("follow_path", "FollowPath", {"path": "{header: {stamp: {sec: 0, nanosec: 0}, frame_id: 'map'}, poses: [%s]}" % (POSE % (1.5, 1.5))}, "true"),
    ("navigate_through_poses", "NavigateThroughPoses", {"poses": "[%s, %s]" % (POSE % (2.0, 1.5), POSE % (3.0, 2.0))}, "true"),
    ("dock_robot", "DockRobot", {"use_dock_id": "true", "dock_id": "'dock'"}, "_event.data.result.success"),
]
CHART = """<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" initial="going">
  <state id="going">
    <onentry><send type="thrift" target="%(name)s" event="send_goal">%(goal)s</send></onentry>
    <transition event="%(name)s.send_goal.reply" cond="!_event.data.result.accepted" target="failure"/>
    <transition event="%(name)s.result" cond="_event.data.status === 'SUCCEEDED' &amp;&amp; %(good)s" target="success"/>
    <transition event="%(name)s.result %(name)s.send_goal.error error" target="failure"/>
    <transition event="halt" target="halted"/>
  </state>
  <final id="success"/> <final id="halted"/>
  <final id="failure"><donedata><param name="reason" expr="JSON.stringify(_event)"/></donedata></final>
</scxml>
"""


def place_of_robot():
    code, out, err = run("echo", "ros:/odom", "-n", "1", "--json")
    place = json.loads(json.loads(out)["text"])["pose"]["pose"]["position"]
    return place["x"], place["y"]


def moves_at_command():
    """Whether the robot goes where /cmd_vel says, which holds for a moment each time."""
    first, last = place_of_robot(), None
    check("the robot stands before it is told to move", place_of_robot() == first)
    for _ in range(50):
        code, out, err = run("call", "ros:/cmd_vel?publish", "message", 'linear={"x":0.2,"y":0,"z":0}', 'angular={"x":0,"y":0,"z":0}',
                             "--interface", "geometry_msgs/msg/Twist")
        if code != 0:
            print(out + err)
            return False
        last = place_of_robot()
        if math.dist(first, last) > 0.02:
            return True
    print(first, last)
    return False


def robot_of_nav2():
    """What clients of Nav2 find at the simulated robot: topics, actions and the services that clear costmaps."""
    shutil.copytree(source + "/examples/recharge/world", "world")
    with open("world/world.yaml") as world:
        world = world.read()
    with open("world/world.yaml", "w") as out:
        out.write(world.replace("angular_tolerance: 0.35}", "angular_tolerance: 0.35, contacts: true}"))
    sim = Program("sim", "--world", "world/world.yaml", "--ros", "--headless", "--speed", "10", until="listening on ros:/")
    for topic, member in [("/clock", "clock"), ("/tf", "transforms"), ("/tf_static?qos=transient_local", "transforms"), ("/odom", "twist"), ("/scan", "ranges"), ("/map?qos=transient_local", "info"),
                          ("/amcl_pose", "pose"), ("/battery_state", "percentage")]:
        code, out, err = run("echo", "ros:" + topic, "-n", "1", "--json")
        check("the robot publishes " + topic, code == 0 and member in json.loads(json.loads(out)["text"]), out[:1000] + err)
    check("/cmd_vel moves it", moves_at_command(), sim.said)
    os.makedirs("nav2_client/skills")
    services, leaves, skills = "", "", ""
    for name, kind, goal, good in ACTIONS:
        services += '  %s: {interface: nav2_msgs/action/%s, at: "ros:/%s"}\n' % (name, kind, name)
        skills += "  %s: {subscribe: [%s.result]}\n" % (kind, name)
        leaves += '<Action ID="%s"/>' % kind
        with open("nav2_client/skills/%s.scxml" % kind, "w") as out:
            params = "".join('<param name="%s" expr="%s"/>' % each for each in goal.items())
            out.write(CHART % {"name": name, "goal": params, "good": good})
    for name in ("global", "local"):
        services += '  clear_%s: {interface: nav2_msgs/srv/ClearEntireCostmap, at: "ros:/%s_costmap/clear_entirely_%s_costmap"}\n' % (
            name, name, name)
        leaves += '<Action ID="Clear_%s"/>' % name
        with open("nav2_client/skills/Clear_%s.scxml" % name, "w") as out:
            out.write("""<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" initial="asking">
  <state id="asking">
    <onentry><send type="thrift" target="clear_%s" event="call"><param name="request" expr="{}"/></send></onentry>
    <transition event="clear_%s.call.reply" target="success"/>
    <transition event="clear_%s.call.error error" target="failure"/>
    <transition event="halt" target="halted"/>
  </state>
  <final id="success"/> <final id="failure"/> <final id="halted"/>
</scxml>
""" % (name, name, name))
    with open("nav2_client/mission.xml", "w") as out:
        out.write('<root BTCPP_format="4"><BehaviorTree ID="M"><Sequence>%s</Sequence></BehaviorTree></root>' % leaves)
    with open("nav2_client/sentree.yaml", "w") as out:
        out.write("mission: {file: mission.xml, rate: 10 Hz}\nservices:\n%sskills:\n%s"
                  "deadlines: {call: 20 s, condition: 21 s, budget: 22 s, halt: 20 s, unresponsive: 60 s}\n" % (services, skills))
    os.makedirs("nav2_client/scenarios")
    with open("nav2_client/scenarios/all.yaml", "w") as out:
        out.write("clock: real\nduration: 10 min\nexpect: {mission: SUCCESS}\n")
    watching = watcher()
    echoes = [subprocess.Popen([sentree, "echo", "ros:" + name, "-n", "1"], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True, env=environment)
              for name in ("/navigate_to_pose", "/navigate_to_pose/_action/feedback", "/global_costmap/clear_entirely_global_costmap")]
    code, out, err = run("run", "nav2_client", "--scenario", "all", "--no-record")
    check("every action and service does what it is asked", code == 0, out + err)
    for echo, kinds in zip(echoes, (("send_goal.reply", "status", "feedback", "result"),) * 2 + (("call.reply",),)):
        told, problems = echo.communicate(timeout=PATIENCE)
        check("sentree echo shows what passes at actions and services", set(json.loads(told)) <= set(kinds), told + problems)
    told, _ = watching.communicate(timeout=PATIENCE)
    check("topics and goals of others are observed", watching.returncode == 1 and "violated" in told, told)
    sim.end()


def watcher():
    """A mission that has no part in what it observes: what the robot publishes, and goals that others send."""
    os.makedirs("watcher/monitors")
    os.makedirs("watcher/scenarios")
    with open("watcher/sentree.yaml", "w") as out:
        out.write("""mission: {file: mission.xml, rate: 5 Hz}
services:
  battery: {interface: sensor_msgs/msg/BatteryState, at: "ros:/battery_state"}
observe:
  nav: {interface: nav2_msgs/action/NavigateToPose, at: "ros:/navigate_to_pose?requests"}
  clear: {interface: nav2_msgs/srv/ClearEntireCostmap, at: "ros:/global_costmap/clear_entirely_global_costmap?requests"}
monitors:
  - {file: monitors/others.scxml}
deadlines: {budget: 10 s, condition: 8 s, call: 4 s, halt: 10 s, unresponsive: 20 s}
""")
    with open("watcher/mission.xml", "w") as out:
        out.write('<root BTCPP_format="4"><BehaviorTree ID="M"><Sleep msec="600000"/></BehaviorTree></root>')
    with open("watcher/monitors/others.scxml", "w") as out:
        out.write("""<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" initial="waiting">
  <datamodel><data id="id" expr="''"/></datamodel>
  <state id="waiting"><transition event="battery.message.request" cond="_event.data.args.percentage &lt;= 1" target="heard"/></state>
  <parallel id="heard">
    <state id="goals" initial="none">
      <state id="none"><transition event="nav.send_goal.request" cond="_event.data.args.pose.header.frame_id === 'map'" target="sent"/></state>
      <state id="sent"><transition event="nav.send_goal.reply" cond="_event.data.result.accepted" target="accepted">
        <assign location="id" expr="_event.data.result.goal_id"/>
      </transition></state>
      <state id="accepted"><transition event="nav.feedback.request" cond="_event.data.args.feedback.distance_remaining &gt; 0" target="driving"/></state>
      <state id="driving"><transition event="nav.result.request" cond="_event.data.args.goal_id === id &amp;&amp; _event.data.args.status === 'SUCCEEDED'" target="ended"/></state>
      <state id="ended"/>
    </state>
    <state id="calls" initial="silent">
      <state id="silent"><transition event="clear.call.request" target="asked"/></state>
      <state id="asked"><transition event="clear.call.reply" target="answered"/></state>
      <state id="answered"/>
    </state>
    <transition cond="In('ended') &amp;&amp; In('answered')" target="violated"/>
  </parallel>
  <final id="violated"/>
</scxml>
""")
    with open("watcher/scenarios/others.yaml", "w") as out:
        out.write("clock: real\nduration: 10 min\nstop_when_violated: true\n")
    code, out, err = run("check", "watcher")
    check("a mission may have no part in what it observes", code == 0, out + err)
    with open("watcher/sentree.yaml") as project:
        text = project.read()
    for name, before, after, told in [
            ("published", 'navigate_to_pose?requests"', 'navigate_to_pose?publish"', 'sentree.yaml:5:3: "nav" cannot be observed'),
            ("twice", "  clear:", "  battery:", 'sentree.yaml:6:3: "battery" is a service already'),
            ("release", 'battery_state"', 'battery_state?release=jazzy"', "(the other one: ")]:
        shutil.copytree("watcher", "watcher_" + name)
        with open("watcher_" + name + "/sentree.yaml", "w") as out:
            out.write(text.replace(before, after))
        code, out, err = run("check", "watcher_" + name)
        check("what cannot be observed is told: " + name, code != 0 and told in out + err, out + err)
    return subprocess.Popen([sentree, "run", "watcher", "--scenario", "others", "--no-record"], stdin=subprocess.DEVNULL,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)


def tree_of_nav2():
    """The tree of examples/nav2 drives a robot with Nav2's actions as it drives the simulated one."""
    with open(source + "/docs/how-to/run-a-nav2-tree.md") as guide:
        yaml = re.search(r"## On a robot with Nav2.*?```yaml\n(.*?)```", guide.read(), re.S).group(1)
    shutil.copytree(source + "/examples/nav2", "nav2_tree")
    for folder in ("world", "models"):
        shutil.rmtree("nav2_tree/" + folder)
    with open("nav2_tree/requirements/recovery.req") as file:
        text = file.read()
    with open("nav2_tree/requirements/recovery.req", "w") as out:
        out.write(text.replace("navigation.spin", "spin.send_goal").replace("navigation.clearCurrentNavigationMap", "clear_global_costmap.call"))
    with open("nav2_tree/sentree.yaml", "w") as out:
        out.write(yaml + "monitors:\n  - {file: requirements/recovery.req}\n")
    os.remove("nav2_tree/scenarios/shut.yaml")
    os.remove("nav2_tree/requirements/robot.req")
    for name in ("free", "blocked"):
        # What a timeline does to the simulator, the test does to the robot.
        with open("nav2_tree/scenarios/%s.yaml" % name) as file:
            text = re.sub(r"timeline:\n(  - .*\n)*", "", file.read())
        with open("nav2_tree/scenarios/%s.yaml" % name, "w") as out:
            out.write(text + "clock: {real: 4}\n")
    code, out, err = run("check", "nav2_tree")
    check("the tree fits Nav2's actions", code == 0, out + err)
    for name in ("free", "blocked"):
        code, out, err = run("run", "examples/nav2", "--scenario", name, "--no-record")
        check(name + " ends as expected in the simulator", code == 0, out + err)
        sim = Program("sim", "--world", "examples/nav2/world/world.yaml", "--ros", "--headless", "--speed", "4", until="listening on ros:/")
        if name == "blocked":
            simulation("addObstacle", "id=crate", 'centre={"x":11.7,"y":5.75}', "radius=0.45")
        mission = subprocess.Popen([sentree, "run", "nav2_tree", "--scenario", name, "--record", name + ".mcap"], stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)
        told, is_blocked = "", name == "blocked"
        for line in mission.stdout:
            told += line
            if is_blocked and "Spin" in line and "SUCCESS" in line:
                simulation("removeObstacle", "id=crate")
                is_blocked = False
        check(name + " ends so by Nav2's actions", mission.wait(PATIENCE) == 0, told[-5000:])
        sim.end()
    code, out, err = run("replay", "free.mcap")
    check("a recording of it has the charts of its leaves", code == 0 and "behaves as recorded" in out, out + err)


def simulation(method, *arguments):
    code, out, err = run("call", "ros:/simulation", method, *arguments, "--interface", "robot.thrift/Simulation")
    check("simulation." + method, code == 0, out + err)


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


def verdicts():
    check_verdicts(run, check, source, "ros:/robot/", "ros:/goto", "ros:/level")


if __name__ == "__main__":
    _, told, _ = run("doctor")
    if "ROS 2 by Fast DDS" not in told:
        print("skipped: this build has no DDS")
        sys.exit(77)
    only = sys.argv[4:]
    for part in (what_is_only_heard, addresses, topic_of_nobody, simulated_robot, goal_by_hand, robot_of_nav2, tree_of_nav2, verdicts, topics):
        if not only or part.__name__ in only:
            part()
    print("all good" if failures == 0 else "%d failures" % failures)
    sys.exit(failures != 0)
