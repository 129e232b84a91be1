#!/usr/bin/env python3
"""Trees of Nav2, unmodified, drive the simulated robot in virtual time, and recover where something stands in the way.

usage: nav2_trees_test.py SENTREE SOURCE_DIR WORK_DIR
The trees are not part of this repository: $SENTREE_CORPUS, else shared/corpus beside it. $SENTREE_NAV2_TREES adds a folder of others.
"""

import glob
import os
import re
import shutil
import subprocess
import sys

sentree, source, work = (os.path.abspath(path) for path in sys.argv[1:4])
corpus = os.environ.get("SENTREE_CORPUS", source + "/../shared/corpus")
folders = glob.glob(corpus + "/bt/*navigation2/nav2_bt_navigator/behavior_trees")
folders += [folder for folder in [os.environ.get("SENTREE_NAV2_TREES")] if folder]
# What they need and the simulated robot does not have.
CANNOT = {
    "navigate_on_route_graph_w_recovery.xml": "a graph of routes",
    "navigate_to_pose_w_bounds_check.xml": "IsWithinPathTrackingBounds: feedback of a controller",
    "navigate_w_replanning_speed.xml": "SpeedController",
    "odometry_calibration.xml": "drives a square, not to a goal",
}
failures = 0


def check(what, good, more=""):
    global failures
    print(("ok   " if good else "FAIL ") + what + ("" if good else "\n" + str(more)), flush=True)
    failures += not good


def project(tree_file):
    """The example's world and scenarios with that tree in place of the example's own."""
    with open(tree_file) as text:
        text = text.read()
    tree = re.search(r'main_tree_to_execute="(\w+)"', text).group(1)
    folder = os.path.join(work, os.path.basename(tree_file)[:-4])
    shutil.copytree(source + "/examples/nav2", folder)
    os.makedirs(work + "/recharge", exist_ok=True)
    shutil.copytree(source + "/examples/recharge/world", work + "/recharge/world", dirs_exist_ok=True)
    shutil.copyfile(tree_file, folder + "/navigate.xml")
    with open(folder + "/mission.xml") as mission:
        mission = mission.read()
    with open(folder + "/mission.xml", "w") as out:
        out.write(mission.replace('SubTree ID="Navigate"', 'SubTree ID="%s"' % tree))
    # Its model answers what its own tree asks.
    with open(folder + "/sentree.yaml") as file:
        text = re.sub(r"(?ms)^models:.*", "", file.read())
    with open(folder + "/sentree.yaml", "w") as out:
        out.write(text.replace("services:", "services:\n  localization: {interface: robot.thrift/Localization, at: sim}"))
    return folder


def run(folder, scenario):
    done = subprocess.run([sentree, "run", folder, "--scenario", scenario, "--no-record", "--json"], stdin=subprocess.DEVNULL,
                          capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


LEAVES = """<root BTCPP_format="4"><BehaviorTree ID="Leaves"><Sequence>
  <Script code="goal := '0;map;14.6;8.8;0;0;0;0;1'"/>
  <ComputePathToPose goal="{goal}" path="{path}"/>
  <SmoothPath unsmoothed_path="{path}" smoothed_path="{smooth}" check_for_collisions="true"/>
  <IsPathValid path="{smooth}"/>
  <TruncatePath input_path="{smooth}" output_path="{short}" distance="1.0"/>
  <GetPoseFromPath path="{short}" index="-1" pose="{last}"/>
  <RemovePassedGoals input_goals="{short}" output_goals="{left}"/>
  <NavigateThroughPoses goals="{left}"/>
  <GoalReached goal="{last}"/>
  <GetCurrentPose current_pose="{here}"/>
  <GoalReached goal="{here}"/>
  <Inverter><GoalReached goal="{goal}"/></Inverter>
  <DockRobot dock_id="dock"/>
  <IsBatteryCharging/>
  <UndockRobot/>
  <Inverter><IsBatteryCharging/></Inverter>
  <Inverter><DockRobot dock_id="nowhere" error_code_id="{code}"/></Inverter>
  <ScriptCondition code="code == 901"/>
</Sequence></BehaviorTree></root>
"""


def leaves():
    """Leaves that no tree of Nav2's own has."""
    folder = work + "/leaves"
    shutil.copytree(source + "/examples/recharge/world", folder + "/world")
    with open(folder + "/world/world.yaml") as world:
        world = world.read()
    with open(folder + "/world/world.yaml", "w") as out:
        out.write(world.replace("angular_tolerance: 0.35}", "angular_tolerance: 0.35, contacts: true}"))
    with open(folder + "/mission.xml", "w") as out:
        out.write(LEAVES)
    with open(folder + "/sentree.yaml", "w") as out:
        out.write("mission: {file: mission.xml, rate: 10 Hz}\npalettes: [nav2]\nworld: world/world.yaml\nservices:\n" + "".join(
            "  %s: {interface: robot.thrift/%s, at: sim}\n" % (name.lower(), name) for name in ("Navigation", "Localization", "Battery")))
    done = subprocess.run([sentree, "run", folder, "--clock", "virtual", "--duration", "10 min", "--no-record"], stdin=subprocess.DEVNULL,
                          capture_output=True, text=True)
    check("paths are smoothed and cut, goals removed, a dock found and left", done.returncode == 0, done.stdout[-3000:] + done.stderr)


def main():
    shutil.rmtree(work, ignore_errors=True)
    os.makedirs(work)
    leaves()
    trees = sorted(file for folder in folders for file in glob.glob(folder + "/*.xml"))
    if not trees:
        print("there are no trees of Nav2 in " + corpus)
        return 1 if failures else 0
    ran = 0
    for tree in trees:
        name = os.path.basename(tree)
        if name in CANNOT:
            print("left out: %s %s" % (name, CANNOT[name]))
            continue
        folder = project(tree)
        code, out, err = run(folder, "free")
        check(name + " drives to the kitchen", code == 0, out + err)
        if "RecoveryNode" in open(tree).read():
            code, out, err = run(folder, "blocked")
            check(name + " recovers from what stands in the door", code == 0, out + err)
        ran += 1
    check("some ran", ran > 0)
    return 1 if failures else 0


sys.exit(main())
