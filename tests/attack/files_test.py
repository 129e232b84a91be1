#!/usr/bin/env python3
"""files_test.py SENTREE SOURCE WORK [--seconds S] [--seed N] [--only KIND] [--cpu]: every command over hostile files of every kind.

Those that are wrong by intent come first, then slips in the files of the examples until S seconds of processor time are used (20 unless said; the
same seed, the same cases). What fails is made smaller and left in WORK/found with the command that repeats it."""
import argparse
import json
import os
import random
import re
import resource
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import inputs

arguments = argparse.ArgumentParser()
arguments.add_argument("sentree", type=Path)
arguments.add_argument("source", type=Path)
arguments.add_argument("work", type=Path)
arguments.add_argument("--seconds", type=float, default=20)
arguments.add_argument("--seed", type=int, default=1)
arguments.add_argument("--only", help="kinds, with commas")
arguments.add_argument("--sanitized", action="store_true", help="no bound on address space, five times the time")
arguments.add_argument("--slips-only", action="store_true")
options = arguments.parse_args()
sentree, source, work = options.sentree.resolve(), options.source.resolve(), options.work.resolve()

SLOW = 5 if options.sanitized else 1
kCpu_s = 20 * SLOW
kWall_s = 900
kAsleep = 1000  # so many looks, of which most are 20 ms apart, at a command that waits for nothing that could come
kMemory_bytes = 3 << 30        # of addresses
kResident_bytes = (1 << 30) * SLOW
kShrinkTries = 60
kKeptOfAClass = 4
kShareByIntent = 0.6  # of a short attack
# 0 to 4: docs; 100 to 118: a command line that CLI11 refuses; 124, 130: as documented.
CODES = {0, 1, 2, 3, 4, 124, 130, *range(100, 119)}
CRASH = re.compile(rb"terminate called|bad_alloc|length_error|what\(\):|std::|Assertion|assertion|AddressSanitizer|runtime error:|ThreadSanitizer|LeakSanitizer|stack overflow|out of memory", re.I)
MISSING = re.compile(r"no service \"|can never decide|there is no ")  # what is not there has no line
PLACE = re.compile(r"[^\s:]:\d+(:\d+)?:")

shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
os.chdir(work)
for name in ("run", "tmp", "home"):
    (work / name).mkdir()
environment = dict(os.environ, XDG_RUNTIME_DIR=str(work / "run"), TMPDIR=str(work / "tmp"), HOME=str(work / "home"), SENTREE_RUNS=str(work / "runs"),
                   TERM="dumb", ASAN_OPTIONS="detect_leaks=0")


# ---- the project that everything hostile is put into

shutil.copytree(source / "examples/minimal", work / "pristine", ignore=shutil.ignore_patterns("verify", "campaign", "runs"))
pristine = work / "pristine"
(pristine / "interfaces").mkdir()
shutil.copy(source / "interfaces/robot.thrift", pristine / "interfaces")
(pristine / "interfaces/lamp_msgs/srv").mkdir(parents=True)
(pristine / "interfaces/lamp_msgs/action").mkdir()
(pristine / "interfaces/lamp_msgs/msg").mkdir()
(pristine / "interfaces/lamp_msgs/msg/Colour.msg").write_text("uint8 RED=1\nstring name\nfloat64[3] rgb\nstring<=10[<=4] other 'x'\n".replace(" 'x'", ""))
(pristine / "interfaces/lamp_msgs/srv/Lamp.srv").write_text("bool on true\nlamp_msgs/Colour colour\n---\nbool ok\n")
(pristine / "interfaces/lamp_msgs/action/Dim.action").write_text("float32 to\n---\nfloat32 reached\n---\nfloat32 now\n")
text = (pristine / "sentree.yaml").read_text()
(pristine / "ros.yaml").write_text(text.replace("services:\n", 'services:\n  lamp: {interface: lamp_msgs/srv/Lamp, at: "ros:/lamp"}\n  dim: {interface: lamp_msgs/action/Dim, at: "ros:/dim"}\n', 1))
(pristine / "campaign.yaml").write_text("runs: 2\nparameters:\n  world.battery.initial: {uniform: [20 %, 100 %]}\nfaults:\n  any_of:\n    - {kill: GoTo, at: {uniform: [0 s, 9 s]}}\n")


def texts_below(folder, *endings):
    return [f.read_text(errors="surrogateescape") for f in sorted(folder.rglob("*")) if f.suffix in endings and f.stat().st_size < 60_000 and "build" not in f.parts]


examples = source / "examples"
# kind: (where the file goes, texts to make slips in)
KINDS = {
    "project": ("sentree.yaml", [(pristine / "sentree.yaml").read_text()] + texts_below(examples, ".yaml")),
    "scenario": ("scenarios/visit.yaml", [f.read_text() for f in sorted(examples.glob("*/scenarios/*.yaml"))]),
    "tree": ("mission.xml", [(pristine / "mission.xml").read_text()] * 3 + texts_below(examples, ".xml") + texts_below(source / "conformance", ".xml")),
    "chart": ("skills/GoTo.scxml", [(pristine / "skills/GoTo.scxml").read_text()] * 3 + texts_below(examples, ".scxml")),
    "monitor": ("monitors/one_goal_at_a_time.scxml", [(pristine / "monitors/one_goal_at_a_time.scxml").read_text()] + texts_below(examples / "recharge/monitors", ".scxml")),
    "requirement": ("requirements/battery.req", [(pristine / "requirements/battery.req").read_text()] + texts_below(examples, ".req")),
    "thrift": ("interfaces/robot.thrift", [(source / "interfaces/robot.thrift").read_text()] + texts_below(examples, ".thrift")),
    "msg": ("interfaces/lamp_msgs/msg/Colour.msg", texts_below(source / "interfaces", ".msg")),
    "srv": ("interfaces/lamp_msgs/srv/Lamp.srv", texts_below(source / "interfaces", ".srv") + [(pristine / "interfaces/lamp_msgs/srv/Lamp.srv").read_text()]),
    "action": ("interfaces/lamp_msgs/action/Dim.action", texts_below(source / "interfaces", ".action")),
    "world": ("world/world.yaml", [(pristine / "world/world.yaml").read_text()] * 2 + [f.read_text() for f in sorted(examples.glob("*/world/*.yaml")) + sorted(examples.glob("*/world.yaml"))]),
    "map": ("world/room.yaml", [(pristine / "world/room.yaml").read_text()]),
    "image": ("world/room.pgm", [(pristine / "world/room.pgm").read_bytes().decode("latin-1")]),
    "campaign": ("campaign.yaml", [(pristine / "campaign.yaml").read_text(), (examples / "recharge/campaign.yaml").read_text()]),
    "recording": ("run.mcap", []),
    "json": ("given.json", ['{"percent": 10, "a": [1, 2, {"b": null, "c": true}], "d": "e\\u00e9", "f": 1.5e3}']),
    "import": ("system/main.xml", texts_below(source / "src/import/testdata", ".xml", ".scxml", ".cpp", ".h", ".thrift", ".ascxml")),
}
NONSENSE_KIND = {"monitor": "chart", "import": "tree"}
BINARY = {"image", "recording"}


def commands(kind, project, file):
    """Everything that opens such a file: (words, standard input)."""
    p, f = str(project), str(file)
    short = ["--duration", "3 s"]
    run = [(["run", p, "--clock", "virtual", "--no-record", *short], b"")]
    verify = [(["verify", p, "--ticks", "3", "--time", "3 s", "--memory", "500 MB", "--out", p + "/verify"], b"")]
    whole = [(["check", p], b""), *run, *verify, (["model", p], b""), (["graph", p], b""), (["test", p, "--scenario", "visit"], b""), (["fmt", "--check", p], b""), (lsp(file), None)]
    of_tree = [(["check", f], b""), (["fmt", "--check", f], b""), (["graph", f], b""), (["graph", f, "--to", "mermaid"], b""), (["model", f], b""),
               (["diff", f, str(pristine / KINDS[kind][0])], b""), (["diff", str(pristine / KINDS[kind][0]), f], b"")]
    if kind in ("project", "campaign"):
        campaign = [(["campaign", p, "-n", "2", "-j", "1", "--no-shrink", "--out", p + "/campaign"], b""), (["run", p, "--vary", f, "--seed", "1000001", "--clock", "virtual", "--no-record"], b"")]
        return [(["check", f if kind == "project" else p], b""), *campaign] + (whole if kind == "project" else [])
    if kind == "scenario":
        return [(["check", f], b""), (["run", f, "--clock", "virtual", "--no-record", *short], b""), (["test", f], b""), (["verify", p, "--scenario", f, "--ticks", "3", "--time", "3 s", "--out", p + "/verify"], b""),
                (["check", p], b""), (lsp(file), None)]
    if kind == "tree":
        return of_tree + whole
    if kind == "chart":
        return of_tree + whole + [(["chart", f, "--script-max", "1 s"], b"tick\nwait 2s\nstate\nhelp\nback\nx.y {\"a\":1}\n")]
    if kind == "monitor":
        return of_tree + run + [(["monitor", "check", str(recording), "--monitor", f], b"")]
    if kind == "requirement":
        return [(["check", f], b""), (["monitor", "synth", f, "-o", p + "/charts"], b""), (["monitor", "check", str(recording), "--req", f], b""), *run, (lsp(file), None)]
    if kind == "thrift":
        return [(["check", f], b""), (["check", p], b""), *run, (["call", "unix:/nowhere/battery", "getBatteryState", "--interface", f + "/Battery"], b""), (lsp(file), None)]
    if kind in ("msg", "srv", "action"):
        return [(["check", p], b"")]
    if kind in ("world", "map", "image"):
        w = p + "/world/world.yaml"
        return [(["check", w], b""), (["sim", "--world", w, "--speed", "0", "--headless", *short], b""), (["graph", w], b""), (["graph", w, "-o", p + "/w.png", "--after", "1 s"], b""), *run]
    if kind == "recording":
        to = [(["export", f, "--to", form, "-o", p + "/out." + form], b"") for form in ("csv", "ndjson", "scenario", "perfetto", "btlog", "fbl")]
        return [(["info", f], b""), (["replay", f], b""), (["replay", f, "--at", "2 s"], b""), (["report", f, "-o", p + "/out.html"], b""), (["monitor", "check", f], b""),
                (["bug-report", f, "-o", p + "/out.tar.gz"], b""), (["run", "--resume", f], b""), (["replay", f, "--from", "1 s"], b""), *to]
    if kind == "json":
        given = b""
        if file.is_file():
            with open(file, "rb") as opened:
                given = opened.read(1 << 20)
        return [(["call", "unix:/nowhere/battery", "getBatteryState", given.replace(b"\0", b"")[:100_000], "--interface", "robot.thrift/Battery"], b""),
                (["chart", p + "/skills/GoTo.scxml", "--json"], b"e " + given + b"\n")]
    if kind == "import":
        return [(["import", p + "/system", "-o", p + "/imported", "--force"], b""), (["import", f, "-o", p + "/imported2", "--force"], b"")]
    raise AssertionError(kind)


def lsp(file):
    return ["lsp", "--file", str(file)]


def message_of(content):
    octets = json.dumps(content).encode()
    return b"Content-Length: %d\r\n\r\n" % len(octets) + octets


def lsp_input(file):
    uri = "file://" + str(file)
    try:
        with open(file if file.is_file() else os.devnull, "rb") as opened:
            text = opened.read(3_000_000).decode("utf-8", "replace")
    except OSError:
        text = ""
    kind = {"scxml": "xml", "xml": "xml", "yaml": "yaml"}.get(file.suffix[1:], file.suffix[1:])
    out = message_of({"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": {"rootUri": "file://" + str(file.parent), "capabilities": {}}})
    out += message_of({"jsonrpc": "2.0", "method": "initialized", "params": {}})
    out += message_of({"jsonrpc": "2.0", "method": "textDocument/didOpen", "params": {"textDocument": {"uri": uri, "languageId": kind, "version": 1, "text": text}}})
    at = {"textDocument": {"uri": uri}, "position": {"line": min(5, text.count("\n")), "character": 12}}
    for i, method in enumerate(("completion", "hover", "definition", "references", "documentSymbol", "formatting", "prepareRename", "codeLens", "semanticTokens/full", "foldingRange")):
        out += message_of({"jsonrpc": "2.0", "id": 10 + i, "method": "textDocument/" + method, "params": dict(at, options={}, context={"includeDeclaration": True})})
    out += message_of({"jsonrpc": "2.0", "id": 90, "method": "textDocument/rename", "params": dict(at, newName="x")})
    return out + message_of({"jsonrpc": "2.0", "id": 99, "method": "shutdown"}) + message_of({"jsonrpc": "2.0", "method": "exit"})


# ---- one run and what is wrong with it

def limits():
    os.setsid()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (kCpu_s, kCpu_s + 1))
    resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 30, 1 << 30))
    if not options.sanitized:
        resource.setrlimit(resource.RLIMIT_AS, (kMemory_bytes, kMemory_bytes))


def sleeps(pid):
    """Whether no thread of it runs or is about to; on a machine that has no time for it, it does not sleep."""
    try:
        return all(Path(f"/proc/{pid}/task/{thread}/stat").read_text().rpartition(")")[2].split()[0] in "SDt" for thread in os.listdir(f"/proc/{pid}/task"))
    except OSError:
        return False


class Ran:
    pass


def execute(words, given):
    if words[0] == "lsp":
        given, words = lsp_input(Path(words[2])), ["lsp", "--stdio"]
    ran = Ran()
    with open(work / "stdout", "w+b") as out, open(work / "stderr", "w+b") as err, open(work / "stdin", "w+b") as stdin:
        stdin.write(given)
        stdin.seek(0)
        began = time.monotonic()
        process = subprocess.Popen([sentree, *words], stdin=stdin, stdout=out, stderr=err, env=environment, preexec_fn=limits)
        ran.late, asleep = False, 0
        while True:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if pid:
                break
            asleep = asleep + 1 if sleeps(process.pid) else 0
            if asleep >= kAsleep or time.monotonic() - began > kWall_s:
                ran.late = True
                os.killpg(process.pid, signal.SIGKILL)
                pid, status, usage = os.wait4(process.pid, 0)
                break
            time.sleep(0.001 if asleep < 200 else 0.02)
        process.returncode = 0
        try:
            os.killpg(process.pid, signal.SIGKILL)  # what it left behind
        except ProcessLookupError:
            pass
        ran.code = os.waitstatus_to_exitcode(status)
        ran.cpu, ran.wall = usage.ru_utime + usage.ru_stime, time.monotonic() - began
        ran.resident = usage.ru_maxrss * 1024
        for stream, name in ((out, "out"), (err, "err")):
            size = stream.seek(0, 2)
            stream.seek(max(0, size - 60_000))
            setattr(ran, name, stream.read())
    return ran


def wrong_with(ran, words, kind, name, file, nonsense):
    """A short class of failure, or None."""
    if ran.late:
        return "waits for ever"
    if ran.code == -signal.SIGXCPU or ran.cpu > kCpu_s:
        return f"takes more than {kCpu_s} s of processor time"
    if ran.code < 0:
        return f"ended by signal {-ran.code}"
    found = CRASH.search(ran.err)
    if found and not (words[0] in ("chart", "run", "test") and b"assertion" in found[0].lower()):
        return f"says {found[0].decode()!r}"
    if ran.code not in CODES:
        return f"exit code {ran.code}"
    if ran.resident > kResident_bytes:
        return f"takes {ran.resident >> 20} MB"
    if nonsense and ran.code == 0 and words[0] in ("check", "run", "info", "sim", "replay", "report", "export"):
        return "exit code 0"
    if ran.code in (1, 3) and not (ran.err + ran.out).strip():
        return "says nothing"
    if ran.code == 3:
        said = (ran.err + ran.out).decode(errors="replace")
        # A link may be told by where it leads.
        if file.stem not in said and os.path.realpath(file) not in said and not PLACE.search(said):
            return "an error without a place"
        if kind not in BINARY | {"json", "import"} and words[0] != "diff" and file.is_file() and 0 < file.stat().st_size < 4 << 20 and not PLACE.search(said) and not MISSING.search(said):
            return "an error without a line"
    return None


# ---- making smaller

def smaller(octets, fails):
    """Parts are left out while it still fails: halves, quarters, and so on, within kShrinkTries."""
    tries, size = 0, len(octets) // 2
    while size and tries < kShrinkTries:
        at = 0
        while at < len(octets) and tries < kShrinkTries:
            candidate = octets[:at] + octets[at + size:]
            tries += 1
            if fails(candidate):
                octets = candidate
            else:
                at += size
        size //= 2
    return octets


findings = {}
count = {"runs": 0}
used = [0.0]


def fresh(kind):
    project = work / "p"
    shutil.rmtree(project, ignore_errors=True)
    shutil.copytree(pristine, project)
    if kind in ("msg", "srv", "action"):
        shutil.move(project / "ros.yaml", project / "sentree.yaml")
    if kind == "import":
        shutil.copytree(source / "src/import/testdata", project / "system")
    return project, project / KINDS[kind][0]


def attempt(kind, name, put, which, nonsense=False):
    """`put(file)` writes it; `which` of the kind's commands."""
    project, file = fresh(kind)
    file.parent.mkdir(parents=True, exist_ok=True)
    if file.is_dir():
        shutil.rmtree(file)
    file.unlink(missing_ok=True)
    put(file)
    everything = commands(kind, project, file)
    for words, given in (everything if which is None else [everything[which % len(everything)]]):
        ran = execute(words, given)
        count["runs"] += 1
        used[0] += ran.cpu
        wrong = wrong_with(ran, words, kind, name, file, nonsense)
        if os.environ.get("SENTREE_SHOW"):
            print(f"{kind}/{name}: {words[0]} {ran.code} {ran.cpu:.2f} s {ran.resident >> 20} MB {wrong or ''}", flush=True)
        if wrong:
            keep(kind, name, words, given, file, ran, wrong, nonsense)


def keep(kind, name, words, given, file, ran, wrong, nonsense):
    key = (kind, words[0], re.sub(r"\d+", "N", wrong))
    findings[key] = findings.get(key, 0) + 1
    alike = sum(n for (other, _, what), n in findings.items() if (other, what) == (kind, key[2]))
    if alike > kKeptOfAClass:
        return
    folder = work / "found" / f"{len(findings)}-{kind}-{words[0]}-{findings[key]}"
    folder.mkdir(parents=True)
    regular = file.is_file() and not file.is_symlink()
    if regular and name.startswith("slip") and file.stat().st_size < 4 << 20 and not wrong.startswith("takes"):
        original = file.read_bytes()

        def fails(octets):
            file.write_bytes(octets)
            try:
                other = wrong_with(execute(words, given), words, kind, name, file, nonsense)
            except OSError:
                return False
            return other is not None and re.sub(r"\d+", "N", other) == key[2]

        file.write_bytes(smaller(original, fails))
    shutil.copytree(file.parents[len(Path(KINDS[kind][0]).parts) - 1], folder / "p", symlinks=True, ignore=lambda d, names: [n for n in names if not (Path(d, n).is_dir() or Path(d, n).is_file() and Path(d, n).stat().st_size < 8 << 20)])
    said = (ran.out[-1500:] + b"\n" + ran.err[-1500:]).decode(errors="replace")
    words = [w if isinstance(w, str) else repr(w) for w in words]
    (folder / "README").write_text(f"{kind}/{name}, seed {options.seed}: {wrong}\nsentree {' '.join(words)}\nexit code {ran.code}, {ran.cpu:.1f} s, {ran.resident >> 20} MB\n{said}\n")
    print(f"FAILED {kind}/{name}: sentree {' '.join(words)[:200]}: {wrong}   ({folder})\n    {said[-300:]!r}", flush=True)


# ---- what is put there

def octets_of(value):
    return value if isinstance(value, bytes) else value.encode("utf-8", "surrogateescape")


def special_files():
    def fifo(file):
        os.mkfifo(file)

    def bound_socket(file):
        here = os.getcwd()
        os.chdir(file.parent)  # its address is short
        with socket.socket(socket.AF_UNIX) as listening:
            listening.bind(file.name)
        os.chdir(here)

    yield "fifo", fifo
    yield "folder", lambda file: file.mkdir()
    yield "socket", bound_socket
    yield "missing", lambda file: None
    yield "unreadable-link", lambda file: file.symlink_to("/proc/self/mem")
    yield "link-to-itself", lambda file: file.symlink_to(file.name)
    yield "link-to-nowhere", lambda file: file.symlink_to("nowhere")
    for device in ("zero", "random", "null", "full", "tty"):
        yield "link-to-" + device, lambda file, device=device: file.symlink_to("/dev/" + device)
    yield "sparse", lambda file: os.truncate(os.open(file, os.O_CREAT | os.O_WRONLY), 1 << 33)


kinds = options.only.split(",") if options.only else list(KINDS)
chance = random.Random(options.seed)
recording = work / "run.mcap"
made = execute(["run", str(pristine), "--clock", "virtual", "--duration", "20 s", "--record", str(recording)], b"")
assert made.code in (0, 1, 124), made.err
records = inputs.parts_of_mcap(recording.read_bytes())
assert execute(["info", str(recording)], b"").code == 0
(work / "again.mcap").write_bytes(inputs.as_mcap(records))
again = execute(["info", str(work / "again.mcap")], b"")
assert again.code == 0, again.err


def by_intent():
    for kind in kinds:
        for name, octets in inputs.NONSENSE_OF_ANY_TEXT.items():
            yield kind, name, lambda file, octets=octets: file.write_bytes(octets)
        for name, value in inputs.NONSENSE.get(NONSENSE_KIND.get(kind, kind), {}).items():
            yield kind, name, lambda file, value=value: file.write_bytes(octets_of(value))
        for name, put in special_files():
            yield kind, name, put


def slip(kind):
    number = chance.randrange(1 << 30)
    mine = random.Random(number)
    if kind == "recording":
        octets = inputs.slipped_mcap(recording.read_bytes(), records, mine)
    else:
        text = inputs.mutated(mine.choice(KINDS[kind][1]), mine, KINDS[kind][1])
        octets = text.encode("latin-1", "replace") if kind in BINARY else inputs.encoded(text, mine)
    return f"slip-{number}", lambda file: file.write_bytes(octets[:2_000_000])


# Nonsense that some command may well accept: an empty requirement file has none, an empty folder of JSON is not asked for, ...
ACCEPTED = {"requirement": {"empty", "bom", "new-lines"}, "thrift": {"empty", "bom", "new-lines"}, "project": {"missing"}, "msg": None, "srv": None, "action": None, "json": None, "campaign": None, "import": None, "image": {"missing"}}
long = options.seconds > 120
cases = [] if options.slips_only else list(by_intent())
if not long:
    chance.shuffle(cases)  # as many as there is time for, of all kinds
for kind, name, put in cases:
    if not long and used[0] > options.seconds * kShareByIntent:
        break
    accepted = ACCEPTED.get(kind, set())
    nonsense = accepted is not None and name not in accepted and name not in ("deep-but-allowed", "script-long", "parallel-history", "many")
    attempt(kind, name, put, None if long else chance.randrange(100), nonsense)
while used[0] < options.seconds:
    kind = chance.choice(kinds)
    name, put = slip(kind)
    attempt(kind, name, put, chance.randrange(100))

left = [name for name in os.listdir(work / "tmp")] + [name for name in os.listdir(work / "run")]
if left:
    print(f"left in the temporary folder: {left[:10]}")
print(f"{count['runs']} runs, {used[0]:.0f} s of processor time, seed {options.seed}: {len(findings)} kinds of failure")
for key, n in sorted(findings.items()):
    print(f"  {n} × {key[0]}: sentree {key[1]}: {key[2]}")
sys.exit(1 if findings else 0)
