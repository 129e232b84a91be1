#!/usr/bin/env python3
"""Twice the input takes about twice the time: every reader and every command that reads, on large generated files.

usage: growth_test.py SENTREE FOLDER [ONLY]

ONLY: those of whose names it is a part.

Each file, and each project with what is made of it, is tried at n and at 2n elements, within 1 GB and 60 s. What took less than kFloor_s is too
quick to tell.
"""
import json
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
kElements = 24_000
EXAMPLE = Path(__file__).resolve().parent.parent / "examples" / "recharge"

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
    "json.xml": lambda n: TREE.format("<SetBlackboard output_key='e' value='json:{" + many("&quot;k{i}&quot;: {i}", n, ", ") + "}'/>", ""),
    "deep.xml": lambda n: TREE.format(nested("<Inverter>", "</Inverter>", n), ""),
    # One beside the other, four deep: the paths of a chain are together as long as its length squared.
    "subtrees.xml": lambda n: '<root BTCPP_format="4" main_tree_to_execute="T"><BehaviorTree ID="T"><Sequence>' + "".join(f'<SubTree ID="T{i}"/>' for i in range(0, n // 13, 4)) + "</Sequence></BehaviorTree>" + "".join(f'<BehaviorTree ID="T{i}">' + (f'<SubTree ID="T{i + 1}"/>' if i % 4 < 3 else "<AlwaysSuccess/>") + "</BehaviorTree>" for i in range(4 * (n // 52) + 4)) + "</root>",
    "entities.xml": lambda n: TREE.format('<AlwaysSuccess name="' + "&amp;" * n + '"/>', ""),
    "transitions.scxml": lambda n: CHART.format('<state id="a">' + many('<transition event="e{i}" target="a"/>', n) + "</state>"),
    "states.scxml": lambda n: CHART.format(many('<state id="s{i}"><transition event="e" target="s{next}"/></state>', n // 2)),
    "data.scxml": lambda n: CHART.format("<datamodel>" + many('<data id="d{i}" expr="{i}"/>', n) + '</datamodel><state id="a"/>'),
    "json.scxml": lambda n: CHART.format('<datamodel><data id="d">{' + many('"k{i}": [{i}]', n, ", ") + '}</data></datamodel><state id="a"/>'),
    "deep_json.scxml": lambda n: CHART.format('<datamodel><data id="d">' + nested("[", "]", n) + '</data></datamodel><state id="a"/>'),
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
    "conditioned.scxml": lambda n: CHART.format('<datamodel><data id="x" expr="1"/></datamodel><state id="a">' + many('<transition event="e{i}" cond="String(x).length &gt; {i}" target="a"/>', n) + "</state>"),
    "lets.req": lambda n: "let l0 = reply(a.b)\n" + many("let l{next} = l{i} + 1\n", n // 4 - 1),
    "words.req": lambda n: many("let word{i} = reply(a.b)\n", n // 8) + many("r{i}: always wrod{i} >= {i}.\n", 900),
    "p/msg/Fields.msg": lambda n: many("int32 a{i}\n", min(n, 16000)),
    "p/srv/Fields.srv": lambda n: many("int32 a{i}\n", n // 4) + "---\n" + many("int32 A{i}=1\n", n // 4),
    "p/action/Fields.action": lambda n: many("int32 a{i}\n", n // 4) + "---\nint32 b\n---\n" + many("int32 a{i}\n", n // 4),
    "requirements.req": lambda n: many("r{i}: always reply(a.b) >= {i}.\n", n // 8),
    "definitions.req": lambda n: many("let l{i} = reply(a.b)\n", n // 8) + "r: always l0 >= 1.\n",
    "keys/sentree.yaml": lambda n: many("k{i}: 1\n", n),
    "no_project/k.yaml": lambda n: many("k{i}: 1\n", n),
    "override/scenarios/s.yaml": lambda n: "override:\n  services:\n" + many("    s{i}: {{at: sim}}\n", n // 4),
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
    ".msg": [["check"]],
    ".srv": [["check"]],
    ".action": [["check"]],
}

SERVED = "mission: {{file: mission.xml, rate: 10 Hz}}\nservices: {{a: {{{}}}}}\n"


def replaced(file, old, new):
    text = (EXAMPLE / file).read_text()
    assert old in text, (file, old)
    return text.replace(old, new, 1)


def wide_thrift(n):
    """Twelve structs; each but the first has some ten fields of the one before: by their paths they are 10^12."""
    bodies = ["1: i32 a"] + [many(f"T{k - 1} a{{i}}", n // (kElements // 10), ", ") for k in range(1, 12)]
    text = "".join(f"struct T{k} {{{body}}}\n" for k, body in enumerate(bodies)) + "service A { T11 ask(1: T11 what) }\n"
    return {"interfaces/a.thrift": text, "mission.xml": TREE.format("<AlwaysSuccess/>", ""), "sentree.yaml": SERVED.format('interface: a.thrift/A, at: "tcp://127.0.0.1:1"')}


def wide_ros(n):
    files = {"interfaces/p/msg/T0.msg": "int32 a\n", "interfaces/p/srv/Ask.srv": "T11 a\n---\nT11 b\n"}
    for k in range(1, 12):
        files[f"interfaces/p/msg/T{k}.msg"] = many(f"p/T{k - 1} a{{i}}\n", n // (kElements // 10))
    return {**files, "mission.xml": TREE.format("<AlwaysSuccess/>", ""), "sentree.yaml": SERVED.format('interface: p/srv/Ask, at: "ros:/a"')}


def served_by_none(n):
    """Services without a model; a tenth of them is asked by a leaf each."""
    n //= 48
    files = {"interfaces/s.thrift": many("struct T{i} {{ 1: i32 f{i} }}\nservice S{i} {{ T{i} ask() }}\n", n), "mission.xml": TREE.format(many("<A{i}/>", n // 10), "")}
    for i in range(n // 10):
        files[f"skills/A{i}.scxml"] = CHART.format(
            f'<state id="a"><onentry><send type="thrift" target="s{i}" event="ask"/></onentry><transition event="s{i}.ask.reply" target="success"/>'
            '<transition event="error" target="failure"/></state><final id="success"/><final id="failure"/>')
    files["sentree.yaml"] = "mission: {file: mission.xml, rate: 10 Hz}\nservices:\n" + many('  s{i}: {{interface: s.thrift/S{i}, at: "tcp://127.0.0.1:1"}}\n', n) + "monitors: [{file: r.req}]\n"
    files["r.req"] = "r: never reply(s0.ask).f0 > 5.\n"
    return files


def asked(n):
    """A tick asks each leaf, one after the other: every step of the tree is one of a leaf."""
    return {"mission.xml": TREE.format(many('<Act name="n{i}"/>', n // 8), ""), "sentree.yaml": "mission: {file: mission.xml, rate: 10 Hz}\nmonitors: [{file: r.req}]\n",
            "r.req": "r: never node(n5) in FAILURE.\n", "skills/Act.scxml": CHART.format('<state id="a"><transition target="success"/></state><final id="success"/>')}


def lsp(name, text):
    """What an editor says that opens a file, types a letter and asks for its outline."""
    document = {"uri": "file:///nowhere/" + name}
    said = [("initialize", {"processId": None, "rootUri": None, "capabilities": {}}, 1), ("initialized", {}, None),
            ("textDocument/didOpen", {"textDocument": {**document, "languageId": "xml", "version": 1, "text": text}}, None),
            ("textDocument/didChange", {"textDocument": {**document, "version": 2}, "contentChanges": [{"text": text + "\n"}]}, None),
            ("textDocument/documentSymbol", {"textDocument": document}, 2), ("shutdown", None, 3), ("exit", None, None)]
    stream = ""
    for method, parameters, number in said:
        message = {"jsonrpc": "2.0", "method": method, **({"id": number} if number else {}), **({"params": parameters} if parameters is not None else {})}
        body = json.dumps(message)
        stream += f"Content-Length: {len(body)}\r\n\r\n{body}"
    return stream


def ticking(n):
    return {"mission.xml": TREE.format('<KeepRunningUntilFailure><AlwaysSuccess/></KeepRunningUntilFailure>', ""), "sentree.yaml": "mission: {file: mission.xml, rate: 10 Hz}\nmonitors: [{file: r.req}]\n",
            "r.req": "r: never node(AlwaysSuccess) in FAILURE.\n", "scenarios/s.yaml": f"duration: {n // 40} s\n"}


# {} is the project's folder; < what is written to the program.
RECORDED = [["run", "{}/scenarios/s.yaml", "--clock", "virtual", "--record", "{}/run.mcap"], ["info", "{}/run.mcap"], ["replay", "{}/run.mcap"],
            ["report", "{}/run.mcap", "-o", "{}/report.html"], ["monitor", "check", "{}/run.mcap"], ["export", "{}/run.mcap", "--to", "csv", "-o", "{}/run.csv"],
            ["export", "{}/run.mcap", "--to", "ndjson", "-o", "{}/run.ndjson"], ["test", "{}"]]
# What else belongs to it, its files, what is done with it.
PROJECTS = {
    "wide structs": (None, wide_thrift, [["check", "{}"]]),
    "wide messages": (None, wide_ros, [["check", "{}"]]),
    "recording": (None, ticking, RECORDED),
    "leaves": (None, lambda n: {"mission.xml": TREE.format(many('<AlwaysSuccess name="n{i}"/>', n // 8), ""), "sentree.yaml": "mission: {file: mission.xml, rate: 10 Hz}\n"},
               [["check", "{}"], ["run", "{}", "--clock", "virtual", "--record", "{}/run.mcap"], ["verify", "{}", "--out", "{}/verify"], ["replay", "{}/run.mcap"], ["report", "{}/run.mcap", "-o", "{}/report.html"]]),
    "leaves that are asked": (None, asked, [["verify", "{}", "--out", "{}/verify"]]),
    "import": (None, lambda n: {"main_tree.xml": TREE.format(many('<Action ID="A{i}"/>', n // 100), "")}, [["import", "{}/main_tree.xml", "-o", "{}/project"]]),
    "locations": (EXAMPLE, lambda n: {"world/world.yaml": replaced("world/world.yaml", "locations:\n", "locations:\n" + many("  loc{i}: {{x: 1.0}}\n", n // 8))}, [["check", "{}"]]),
    "map": (EXAMPLE, lambda n: {"world/house.pgm": f"P2\n320 {n // 16}\n2\n" + ("2 " * 320 + "\n") * (n // 16)}, [["check", "{}"]]),
    "parameters": (EXAMPLE, lambda n: {"campaign.yaml": "runs: 2\nparameters:\n" + many("  wrold.k{i}: {{uniform: [0, 1]}}\n", n // 8)}, [["check", "{}"]]),
    "equal faults": (EXAMPLE, lambda n: {"campaign.yaml": "runs: 2\nfaults:\n  any_of:\n" + many("    - {{kill: GoToKitchen, at: {{uniform: [0 s, {i} s]}}}}\n", n // 8)}, [["check", "{}"]]),
    "runs": (EXAMPLE, lambda n: {"campaign.yaml": f"runs: {n // 600}\nduration: 10 s\nparameters:\n  world.battery.initial: {{uniform: [20 %, 100 %]}}\n"},
             [["campaign", "{}", "-j", "1", "--no-shrink", "--out", "{}/campaign"]]),
    "services": (None, served_by_none, [["check", "{}"], ["verify", "{}", "--out", "{}/verify"]]),
    "editor": (None, lambda n: {"said": lsp("mission.xml", TREE.format(many('<AlwaysSuccess name="n{i}"/>\n', n // 8), ""))}, [["lsp", "< {}/said"]]),
    "editor of leaves": (None, lambda n: {"said": lsp("mission.xml", TREE.format(many('<Own name="n{i}"/>\n', n), ""))}, [["lsp", "< {}/said"]]),
    "editor of requirements": (None, lambda n: {"said": lsp("all.req", many("let l{i} = reply(a.b)\n", n // 3))}, [["lsp", "< {}/said"]]),
    "editor of scenarios": (None, lambda n: {"said": lsp("scenarios/s.yaml", "timeline:\n" + many("  - {{at: {i} s, kill: a}}\n", n // 3))}, [["lsp", "< {}/said"]]),
    "editor of interfaces": (None, lambda n: {"said": lsp("a.thrift", many("struct S{i} {{ 1: i32 a }}\n", n // 3))}, [["lsp", "< {}/said"]]),
    "editor of leaves on one line": (None, lambda n: {"said": lsp("mission.xml", TREE.format(many('<Own name="n{i}"/>', n), ""))}, [["lsp", "< {}/said"]]),
    "editor of states on one line": (None, lambda n: {"said": lsp("a.scxml", CHART.format(many('<state id="s{i}"/>', n)))}, [["lsp", "< {}/said"]]),
    "editor of a condition on one line": (None, lambda n: {"said": lsp("all.req", "let l = " + many("reply(a.b).m{i}", n // 3, " + ") + "\n")}, [["lsp", "< {}/said"]]),
    "editor of a scenario on one line": (None, lambda n: {"said": lsp("scenarios/s.yaml", "timeline: [" + many("{{at: {i} s, kill: a}}", n // 3, ", ") + "]\n")}, [["lsp", "< {}/said"]]),
    "editor of interfaces on one line": (None, lambda n: {"said": lsp("a.thrift", many("struct S{i} {{ 1: i32 a }} ", n // 3))}, [["lsp", "< {}/said"]]),
}
REFUSED = {"locations", "parameters", "equal faults"}


def limit():
    resource.setrlimit(resource.RLIMIT_AS, (kMemory_bytes, kMemory_bytes))
    resource.setrlimit(resource.RLIMIT_CPU, (kTime_s, kTime_s))


def cost(words, codes):
    """CPU time [s]; what is wrong with how it ended, or None."""
    said = next((Path(word[2:]) for word in words if word.startswith("< ")), None)
    words = [word for word in words if not word.startswith("< ")]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with open(said or os.devnull, "rb") as given:
        ran = subprocess.run([program, *words], stdin=given, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, preexec_fn=limit, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    wrong = None
    if ran.returncode not in codes or b"bad_alloc" in ran.stderr:
        wrong = f"ended with {ran.returncode}: {ran.stderr[-200:].decode(errors='replace')}"
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wrong


def written(name, make, n):
    file = folder / str(n) / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(make(n))
    return file.parent if file.name == "sentree.yaml" else file


def project_written(name, base, make, n):
    place = folder / str(n) / name
    if base:
        shutil.copytree(base, place, ignore=shutil.ignore_patterns("runs", "verify"))
    for file, content in make(n).items():
        (place / file).parent.mkdir(parents=True, exist_ok=True)
        (place / file).write_text(content)
    return place


def compare(shown, small, large, codes):
    """Tries two commands, of which the second has twice as much to do."""
    for attempt in range(kTries):
        (once, wrong), (twice, wrong_too) = cost(small, codes), cost(large, codes)
        if wrong or wrong_too or twice <= kRatioMax * max(once, kFloor_s / kRatioMax) or attempt + 1 == kTries:
            break
    shown = f"{shown}: {once:.2f} s, twice as much {twice:.2f} s"
    if wrong or wrong_too:
        failures.append(f"{shown}: {wrong or wrong_too}")
    elif twice > kRatioMax * max(once, kFloor_s / kRatioMax):
        failures.append(f"{shown}: more than {kRatioMax} times")
    if os.environ.get("SENTREE_SHOW"):
        print(shown, flush=True)


failures = []
tried = 0
shutil.rmtree(folder, ignore_errors=True)
folder.mkdir(parents=True)
environment = {**os.environ, "TMPDIR": str(folder.resolve()), "SENTREE_RUNS": str(folder.resolve() / "runs"), "XDG_RUNTIME_DIR": str(folder.resolve())}
only = sys.argv[3] if len(sys.argv) > 3 else ""
for name, make in FILES.items():
    if only not in name:
        continue
    small, large = written(name, make, kElements), written(name, make, 2 * kElements)
    for command in COMMANDS[Path(name).suffix]:
        tried += 1
        compare(f"{command[0]} {name}", *([str(file) if word is None else word for word in [*command, None]] for file in (small, large)), codes=(0, 1, 2, 3))
for name, (base, make, commands) in PROJECTS.items():
    if only not in name:
        continue
    small, large = project_written(name, base, make, kElements), project_written(name, base, make, 2 * kElements)
    for command in commands:
        tried += 1
        compare(f"{command[0]} of {name}", *([word.replace("{}", str(place)) for word in command] for place in (small, large)), codes=(3,) if name in REFUSED else (0, 1, 124))  # 124: by the limit of its time
shutil.rmtree(folder, ignore_errors=True)
print("\n".join(failures) if failures else f"{tried} pairs grow as their input does")
sys.exit(1 if failures else 0)
