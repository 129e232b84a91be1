#!/usr/bin/env python3
"""What a run costs whose mission has many charts, most of them idle.

  bench/many_charts.py build/release/bin/sentree [1000 10000]

Makes a mission of so many leaves, each a chart of its own (of 200 kinds) that takes a quarter of a second, one after
the other. Prints for each number, and for 100 ticks and 600 in virtual time and 100 in real time: processor time, wall
time and the largest memory of the whole command; what start-up costs is where the two in virtual time would be with no
tick.
"""
import os
import re
import subprocess
import sys
import tempfile
import time

KINDS = 200
CHART = """<?xml version="1.0" encoding="UTF-8"?>
<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" initial="at_work">
  <datamodel><data id="times" expr="0"/></datamodel>
  <state id="at_work">
    <onentry><send event="later" delay="250ms"/></onentry>
    <transition event="later" target="success"><assign location="times" expr="times + 1"/></transition>
  </state>
  <final id="success"/>
</scxml>
"""
MISSION = """<?xml version="1.0" encoding="UTF-8"?>
<root BTCPP_format="4" main_tree_to_execute="Main">
  <BehaviorTree ID="Main"><Sequence>{leaves}</Sequence></BehaviorTree>
  <TreeNodesModel>{kinds}</TreeNodesModel>
</root>
"""


def leaves(first, end):
    """At most ten children a node, as people draw them."""
    if end - first <= 10:
        return "".join(f'<Skill{leaf % KINDS} name="leaf{leaf}"/>' for leaf in range(first, end))
    step = max(10, (end - first + 9) // 10)
    return "".join(f"<Sequence>{leaves(at, min(end, at + step))}</Sequence>" for at in range(first, end, step))


def project(folder, count):
    os.makedirs(os.path.join(folder, "skills"))
    for kind in range(KINDS):
        with open(os.path.join(folder, "skills", f"Skill{kind}.scxml"), "w") as file:
            file.write(CHART)
    kinds = "".join(f'<Action ID="Skill{kind}"/>' for kind in range(KINDS))
    with open(os.path.join(folder, "mission.xml"), "w") as file:
        file.write(MISSION.format(leaves=leaves(0, count), kinds=kinds))
    with open(os.path.join(folder, "sentree.yaml"), "w") as file:
        file.write("mission: {file: mission.xml, rate: 10 Hz}\n")


def measured(command):
    """Ticks, seconds of processor and of wall, megabytes."""
    began = time.monotonic()
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    output = process.stdout.read().decode(errors="replace")
    _, _, usage = os.wait4(process.pid, 0)
    ticks = re.search(r"([\d,]+) ticks", output)
    if not ticks:
        sys.exit(f"FAILED: {' '.join(command)}\n{output[-400:]}")
    wall = time.monotonic() - began
    return ticks[1], usage.ru_utime + usage.ru_stime, wall, usage.ru_maxrss / 1024


def main():
    sentree = sys.argv[1]
    for count in [int(count) for count in sys.argv[2:]] or [1000, 10000]:
        with tempfile.TemporaryDirectory() as folder:
            project(folder, count)
            for clock, seconds in (("virtual", 10), ("virtual", 60), ("real", 10)):
                scenario = os.path.join(folder, f"{clock}{seconds}.yaml")
                with open(scenario, "w") as file:
                    file.write(f"project: sentree.yaml\nclock: {clock}\nduration: {seconds} s\n")
                ticks, cpu, wall, memory = measured([sentree, "run", scenario])
                print(f"{count:6,} charts, {clock} time, {ticks} ticks: {cpu:.2f} s of processor ({wall:.2f} s wall), {memory:.0f} MB")


if __name__ == "__main__":
    main()
