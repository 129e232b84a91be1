"""The recharge example with its robot and two of its skills behind a middleware; for the tests of each."""

import json
import shutil

SCENARIO = """description: everything talks over a middleware
clock: {{real: 20}}
processes:
  robot: {{component: sim, listen: "{robot}"}}
  goto: {{skill: GoToLocation, listen: "{goto}"}}
  level: {{skill: BatteryLevelAbove, listen: "{level}"}}
override:
  services: {{battery: {{at: "{battery}"}}, navigation: {{at: "{{robot}}"}}}}
  skills: {{GoToLocation: {{at: "{{goto}}"}}, BatteryLevelAbove: {{at: "{{level}}"}}}}
  world: {{battery: {{initial: 100 %}}}}
  deadlines: {{call: 1 s, condition: 2 s, budget: 3 s, unresponsive: 5 s}}
timeline:
  - {{at: 20 s, call: simulation.setBatteryCharge, args: {{percent: 10}}}}
duration: 2 min
expect:
  mission: RUNNING
  monitors: {{battery: violated, recharge: undecided, never_empty: violated, turns_to_station: undecided}}
  distinct_processes: true
"""


def check_verdicts(run, check, source, robot, goto, level, battery="{robot}", options=()):
    """The verdicts are those of the simulator in the run's own process.

    run(*arguments) executes sentree in the test's folder, and gives its exit code and what it said on both streams;
    the other texts are addresses."""
    shutil.copytree(source + "/examples/recharge", "recharge")
    with open("recharge/scenarios/elsewhere.yaml", "w") as out:
        out.write(SCENARIO.format(robot=robot, goto=goto, level=level, battery=battery))
    _, plain, _ = run("run", "recharge", "--scenario", "experiment1", "--clock", "virtual", "--json", "--no-record")
    _, out, err = run("run", "recharge", "--scenario", "elsewhere", *options, "--json", "--no-record")
    try:
        here, there = json.loads(plain), json.loads(out)
    except ValueError:
        return check("the mission runs elsewhere", False, out + err)
    verdicts = [{m["monitor"]: m["verdict"] for m in report["monitors"]} for report in (here, there)]
    check("the same verdicts as in one process", verdicts[0] == verdicts[1], verdicts)
    check("as expected", there["unmet"] == [], str(there["unmet"]) + err)
