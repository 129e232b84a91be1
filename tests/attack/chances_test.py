#!/usr/bin/env python3
"""chances_test.py SENTREE SOURCE WORK JUMPING_CLOCK [--seed N] [--rounds N]: what a machine does to a run with processes.

Signals at random moments, a disk that is full, few descriptors, standard output that nobody reads, and clocks that jump. A run goes on or ends with
an error that is told; nothing of it lives on, and the next command cleans up behind one that was killed."""
import argparse
import atexit
import json
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

arguments = argparse.ArgumentParser()
arguments.add_argument("sentree", type=Path)
arguments.add_argument("source", type=Path)
arguments.add_argument("work", type=Path)
arguments.add_argument("jumping_clock", type=Path)
arguments.add_argument("--seed", type=int, default=1)
arguments.add_argument("--rounds", type=int, default=2)
options = arguments.parse_args()
sentree, source, work = options.sentree.resolve(), options.source.resolve(), options.work.resolve()
kPatience_s = 180
kNear_s = 5
CRASH = re.compile(r"terminate called|bad_alloc|what\(\):|Assertion|AddressSanitizer|ThreadSanitizer|runtime error:")
chance = random.Random(options.seed)
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
os.chdir(work)
# Paths of sockets are short, wherever this is checked out.
sockets = Path(tempfile.mkdtemp(prefix="s-", dir="/tmp"))
atexit.register(shutil.rmtree, sockets, ignore_errors=True)
environment = dict(os.environ, XDG_RUNTIME_DIR=str(sockets), TMPDIR=str(sockets), SENTREE_RUNS=str(work / "runs"))
shutil.copytree(source / "examples/minimal", work / "minimal")
# Nothing is late because the machine is busy with other things.
(work / "minimal/scenarios/again.yaml").write_text("""clock: {real: 20}
duration: 60 s
override:
  mission: {repeat: true}
  deadlines: {call: 10 s, condition: 20 s, budget: 30 s, halt: 20 s, unresponsive: 60 s}
""")
failures = []
count = {"runs": 0}


def check(what, holds, seen=""):
    if not holds:
        failures.append(what)
        print(f"FAILED {what}\n{str(seen)[-1500:]}", flush=True)


def started(*words, extra=None, limits=lambda: None, output=None):
    count["runs"] += 1

    def before():
        os.setsid()
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
        limits()

    out = output or open(work / "out", "w+b")
    return subprocess.Popen([sentree, *map(str, words)], stdin=subprocess.DEVNULL, stdout=out, stderr=open(work / "err", "w+b"), env=dict(environment, **(extra or {})), preexec_fn=before)


def ended(what, process, codes=(0, 1, 3, 4, 124, 130)):
    try:
        code = process.wait(kPatience_s)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        code = "none: it does not end"
    said = (work / "err").read_text(errors="replace") + (work / "out").read_text(errors="replace")[-3000:]
    check(f"{what} ends in order", code in codes, f"code {code}\n{said}")
    check(f"{what} says nothing of a crash", not CRASH.search(said), said)
    return code, said


def parts(process):
    """Processes of the run, itself left out."""
    found = []
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit() and int(folder.name) != process.pid:
            try:
                words = (folder / "stat").read_text().rpartition(")")[2].split()
                if int(words[3]) == process.pid and words[0] != "Z":
                    found.append(int(folder.name))
            except (OSError, IndexError):
                pass
    return found


def reached(process, n):
    """Waits until the run has made n parts, or has ended."""
    until = time.monotonic() + kPatience_s
    while len(parts(process)) < n and process.poll() is None and time.monotonic() < until:
        time.sleep(0.01)


RUN = ("run", work / "minimal", "--scenario", "again", "--processes", "--no-record")


def signals():
    """Parts get signals, one after the other; then the run itself."""
    for round_ in range(options.rounds):
        process = started(*RUN)
        reached(process, 2)
        for _ in range(6):
            some = parts(process)
            if not some:
                break
            victim, what = chance.choice(some), chance.choice((signal.SIGKILL, signal.SIGSTOP, signal.SIGTERM, signal.SIGINT, signal.SIGPIPE, signal.SIGHUP, signal.SIGUSR1))
            try:
                os.kill(victim, what)
                time.sleep(chance.uniform(0, 0.2))
                os.kill(victim, signal.SIGCONT)
            except ProcessLookupError:
                pass
        code, said = ended(f"a run (seed {options.seed}, round {round_}) whose parts get signals", process)
        check("such a run leaves no part behind", not parts(process), parts(process))
        for what, codes in ((signal.SIGINT, (0, 1, 130)), (signal.SIGTERM, (0, 1, 130, 143, -15)), (signal.SIGHUP, (0, 1, 129, 130, -1)), (signal.SIGKILL, (-9,))):
            process = started(*RUN)
            time.sleep(chance.uniform(0, 1.5))
            process.send_signal(signal.SIGSTOP)
            time.sleep(chance.uniform(0, 0.3))
            process.send_signal(signal.SIGCONT)
            process.send_signal(what)
            ended(f"a run that gets {what.name}", process, codes)
            until = time.monotonic() + kPatience_s
            while parts(process) and time.monotonic() < until:
                time.sleep(0.02)
            check(f"a run that gets {what.name} leaves no part behind", not parts(process), parts(process))
    # Folders younger than a minute are left alone: their run may be about to take them.
    ended("the run behind those that were killed", started(*RUN, "--duration", "1 s", extra={"LD_PRELOAD": str(options.jumping_clock.resolve()), "SENTREE_TEST_JUMP": "forward"}))
    left = [str(p) for p in sockets.glob("sentree-*")]
    check("the run behind those that were killed cleans up", not left, left)


def pipes():
    """Nobody reads what is printed, or the reader goes."""
    for words in (("run", work / "minimal", "--clock", "virtual", "--verbose", "--no-record"), ("check", work / "minimal", "--json"), ("--help",)):
        reading, writing = os.pipe()
        process = started(*words, output=writing)
        os.close(writing)
        os.read(reading, 10)
        os.close(reading)
        ended(f"sentree {words[0]} whose reader goes", process, (0, 1, 3, 4, 141, -13))
    with open("/dev/full", "wb") as full:
        code, said = ended("a run that prints to a full disk", started("run", work / "minimal", "--clock", "virtual", "--json", "--no-record", output=full), (0, 1, 4))


def disks():
    """Files may not grow beyond a few kilobytes, as on a full disk."""
    for size in (0, 1000, 30_000, 300_000):
        def limits(size=size):
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

        recording = work / f"full-{size}.mcap"
        what = f"a run whose recording may have {size} octets"
        reading, writing = os.pipe()
        process = started("run", work / "minimal", "--clock", "virtual", "--record", recording, limits=limits, output=writing)
        os.close(writing)
        text = b""
        while more := os.read(reading, 65536):
            text += more
        os.close(reading)
        code = process.wait(kPatience_s)
        check(f"{what} ends in order", code in (0, 1, 3, 4), f"code {code} {text[-800:]}")
        if recording.exists() and recording.stat().st_size:
            ended(f"sentree info of what {size} octets hold", started("info", recording), (0, 3))
            ended(f"sentree replay of what {size} octets hold", started("replay", recording), (0, 1, 3))
        for words in (("graph", work / "minimal", "-o", work / "g.svg"), ("campaign", work / "minimal", "-n", "2", "-j", "1", "--out", work / "campaign"), ("verify", work / "minimal", "--ticks", "3", "--out", work / "verify"),
                      ("init", work / f"new{size}"), ("fmt", work / "minimal/mission.xml"), ("run", work / "minimal", "--clock", "virtual", "--durable", "--record", work / f"d{size}.mcap")):
            process = started(*words, limits=limits)
            code = process.wait(kPatience_s)
            check(f"sentree {words[0]} with {size} octets a file ends in order", code in (0, 1, 3, 4, 124), code)
        shutil.rmtree(work / "campaign", ignore_errors=True)
    check("fmt leaves a file whole that it cannot write", (work / "minimal/mission.xml").read_bytes() == (source / "examples/minimal/mission.xml").read_bytes())


def descriptors():
    """So few that something cannot be opened, wherever that is."""
    for n in (3, 5, 8, 11, 14, 18, 24, 32):
        def limits(n=n):
            resource.setrlimit(resource.RLIMIT_NOFILE, (n, n))

        for words in (("check", work / "minimal"), (*RUN, "--duration", "2 s"), ("run", work / "minimal", "--clock", "virtual", "--duration", "2 s", "--record", work / "few.mcap"),
                      ("studio", work / "minimal", "--at", "0")):
            process = started(*words, limits=limits)
            if words[0] == "studio":
                time.sleep(0.3)
                process.send_signal(signal.SIGINT)
            # 127: the program itself cannot be loaded.
            ended(f"sentree {words[0]} with {n} descriptors", process, (0, 1, 3, 4, 124, 127, 130, -2))


def clocks():
    """The wall clock is set back, forward, to zero; the machine is suspended for an hour."""
    calm = started("run", work / "minimal", "--scenario", "again", "--json", "--no-record")
    calm_code, _ = ended("a run with a calm clock", calm)
    calm_time = json.loads((work / "out").read_text())["time"]
    for jump in ("back", "forward", "zero", "negative", "suspended", "leaps"):
        recording = work / f"jump-{jump}.mcap"
        process = started("run", work / "minimal", "--scenario", "again", "--processes", "--json", "--record", recording,
                          extra={"LD_PRELOAD": str(options.jumping_clock.resolve()), "SENTREE_TEST_JUMP": jump, "SENTREE_TEST_JUMP_AFTER_S": "1"})
        code, said = ended(f"a run while the clock goes {jump}", process)
        check(f"a run while the clock goes {jump} ends as with a calm clock", code == calm_code, f"{code}, {calm_code}\n{said}")
        try:
            report = json.loads((work / "out").read_text())
            check(f"a run while the clock goes {jump} lasts as long as with a calm clock", abs(report["time"] - calm_time) < kNear_s, report)
        except ValueError:
            check(f"a run while the clock goes {jump} gives its report", False, said)
        ended(f"sentree info of a recording while the clock goes {jump}", started("info", recording), (0,))
        # What was late there because the machine was busy is not late again.
        ended(f"sentree replay of a recording while the clock goes {jump}", started("replay", recording), (0, 1))


for part in (signals, pipes, disks, descriptors, clocks):
    began = time.monotonic()
    part()
    print(f"{part.__name__}: {time.monotonic() - began:.0f} s", flush=True)
print(f"{count['runs']} runs, seed {options.seed}: {len(failures)} failures")
sys.exit(1 if failures else 0)
