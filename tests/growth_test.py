#!/usr/bin/env python3
"""Twice the input takes about twice the time: every reader and every command that reads, on large generated files.

usage: growth_test.py SENTREE FOLDER

Each file is tried at n and at 2n elements, within 1 GB and 60 s. What took less than kFloor_s is too quick to tell.
"""
import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

program, folder = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
kFloor_s = 0.12
kRatioMax = 3.0
kTries = 3
kMemory_bytes = 1 << 30
kTime_s = 60

TREE = '<root BTCPP_format="4"><BehaviorTree ID="M"><Sequence>{}</Sequence></BehaviorTree>{}</root>'
CHART = '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">{}</scxml>'


def many(pattern, n, joint=""):
    return joint.join(pattern.format(i=i, next=(i + 1) % n) for i in range(n))


def nested(begin, end, n):
    return begin * n + end * n


FILES = {
    "attributes.xml": lambda n: TREE.format("<AlwaysSuccess " + many('a{i}="1" ', n) + "/>", ""),
    "leaves.xml": lambda n: TREE.format(many('<AlwaysSuccess name="n{i}"/>', n), ""),
    "unknown.xml": lambda n: TREE.format(many('<Own{i} name="n{i}"/>', n // 8), ""),
    "ports.xml": lambda n: TREE.format(many('<Action ID="A" in="{{i{i}}}" out="{{o{i}}}"/>', n // 8), '<TreeNodesModel><Action ID="A"><input_port name="in" type="double"/><output_port name="out" type="double"/></Action></TreeNodesModel>'),
    "conditions.xml": lambda n: TREE.format('<Script code="n := 1"/>' + many('<AlwaysSuccess _skipIf="n &gt; {i}"/>', n // 8), ""),
    "cases.xml": lambda n: TREE.format('<Script code="m := 1"/>' + many('<Switch2 variable="{{m}}" case_1="{i}" case_2="b"><AlwaysSuccess/><AlwaysSuccess/><AlwaysSuccess/></Switch2>', n // 8), ""),
    "entries.xml": lambda n: TREE.format(many('<Script code="e{i} := {i}"/>', n // 8), ""),
    "palette.xml": lambda n: TREE.format("<AlwaysSuccess/>", "<TreeNodesModel>" + many('<Action ID="A{i}"/>', n // 4) + "</TreeNodesModel>"),
    "comments.xml": lambda n: TREE.format(many("<!-- {i} -->\n", n) + "<AlwaysSuccess/>", ""),
    "deep.xml": lambda n: TREE.format(nested("<Inverter>", "</Inverter>", n), ""),
    "entities.xml": lambda n: TREE.format('<AlwaysSuccess name="' + "&amp;" * n + '"/>', ""),
    "transitions.scxml": lambda n: CHART.format('<state id="a">' + many('<transition event="e{i}" target="a"/>', n) + "</state>"),
    "states.scxml": lambda n: CHART.format(many('<state id="s{i}"><transition event="e" target="s{next}"/></state>', n // 2)),
    "data.scxml": lambda n: CHART.format("<datamodel>" + many('<data id="d{i}" expr="{i}"/>', n) + '</datamodel><state id="a"/>'),
    "sends.scxml": lambda n: CHART.format('<state id="a"><onentry>' + many('<raise event="r{i}"/>', n // 8) + '</onentry><transition event="*"/></state>'),
    "deep.scxml": lambda n: CHART.format("".join(f'<state id="s{i}">' for i in range(n)) + "</state>" * n),
    "lines.scxml": lambda n: CHART.format("\n" * n + '<state id="a"/>' + "\n" * n),
    "integers.thrift": lambda n: "const map<i32,i32> M = {" + many("{i}: {i}", n, ", ") + "}\n",
    "texts.thrift": lambda n: "const map<string,i32> M = {" + many('"k{i}": {i}', n, ", ") + "}\n",
    "set.thrift": lambda n: "const set<i32> S = [" + many("{i}", n, ", ") + "]\n",
    "structs.thrift": lambda n: many("struct S{i} {{ 1: i32 a }}\n", n),
    "fields.thrift": lambda n: "struct S {" + many("{next}: i32 a{i}\n", min(n, 16000)) + "}\n",
    "services.thrift": lambda n: "service S0 { void a() }\n" + "".join(f"service S{i} extends S{i - 1} {{ void a{i}() }}\n" for i in range(1, n // 4)),
    "enumerators.thrift": lambda n: "enum E {" + many("A{i}", n, ", ") + "}\n",
    "requirements.req": lambda n: many("r{i}: always reply(a.b) >= {i}.\n", n // 8),
    "definitions.req": lambda n: many("let l{i} = reply(a.b)\n", n // 8) + "r: always l0 >= 1.\n",
    "keys/sentree.yaml": lambda n: many("k{i}: 1\n", n),
    "brackets/sentree.yaml": lambda n: "[" * n,
    "quotes/sentree.yaml": lambda n: '"' * n,
    "services/sentree.yaml": lambda n: "mission: m.xml\nservices:\n" + many("  s{i}: {{idl: a.thrift, interface: A, at: sim}}\n", n // 16),
    "timeline/scenarios/s.yaml": lambda n: "timeline:\n" + many("  - {{at: {i} s, kill: a}}\n", n // 16),
}
COMMANDS = {
    ".xml": [["check"], ["fmt", "--check"], ["graph"], ["model"], ["diff", None]],
    ".scxml": [["check"], ["fmt", "--check"], ["graph"], ["diff", None]],
    ".thrift": [["check"]],
    ".req": [["check"]],
    ".yaml": [["check"]],
}


def limit():
    resource.setrlimit(resource.RLIMIT_AS, (kMemory_bytes, kMemory_bytes))
    resource.setrlimit(resource.RLIMIT_CPU, (kTime_s, kTime_s))


def cost(command, file):
    """CPU time [s]; what is wrong with how it ended, or None."""
    words = [str(file) if word is None else word for word in command]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    ran = subprocess.run([program, *words, file], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, preexec_fn=limit)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    wrong = None
    if ran.returncode not in (0, 1, 2, 3) or b"bad_alloc" in ran.stderr:
        wrong = f"ended with {ran.returncode}: {ran.stderr[-200:].decode(errors='replace')}"
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wrong


def written(name, make, n):
    file = folder / str(n) / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(make(n))
    return file.parent if file.name == "sentree.yaml" else file


failures = []
shutil.rmtree(folder, ignore_errors=True)
for name, make in FILES.items():
    n = 24_000
    small, large = written(name, make, n), written(name, make, 2 * n)
    for command in COMMANDS[Path(name).suffix]:
        for attempt in range(kTries):
            (once, wrong), (twice, wrong_too) = cost(command, small), cost(command, large)
            if wrong or wrong_too or twice <= kRatioMax * max(once, kFloor_s / kRatioMax) or attempt + 1 == kTries:
                break
        shown = f"{command[0]} {name}: {once:.2f} s, twice as much {twice:.2f} s"
        if wrong or wrong_too:
            failures.append(f"{shown}: {wrong or wrong_too}")
        elif twice > kRatioMax * max(once, kFloor_s / kRatioMax):
            failures.append(f"{shown}: more than {kRatioMax} times")
        if os.environ.get("SENTREE_SHOW"):
            print(shown)
shutil.rmtree(folder, ignore_errors=True)
print("\n".join(failures) if failures else f"{sum(len(COMMANDS[Path(name).suffix]) for name in FILES)} pairs grow as their input does")
sys.exit(1 if failures else 0)
