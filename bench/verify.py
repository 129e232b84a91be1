#!/usr/bin/env python3
"""What `sentree verify` costs, with nothing but a `sentree` program and Python; beside SPIN, where it is installed.

  bench/verify.py build/release/bin/sentree

Prints for each bar the command, what was explored, processor time and wall time of the whole command, and its largest
memory. SPIN gets the graph that `--graph` writes, as one process in Promela, and looks at the same states and
periods.
"""
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = os.path.normpath(os.path.join(os.path.dirname(__file__), ".."))
EXAMPLES = os.path.join(ROOT, "examples")
EXPLORED = re.compile(r"explored +([\d,]+) states, ([\d,]+) periods, (complete|up to tick \d+)")


def measured(command):
    """Its output, and seconds of processor, seconds of wall, megabytes."""
    began = time.monotonic()
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    output = process.stdout.read().decode(errors="replace")
    _, _, usage = os.wait4(process.pid, 0)
    wall = time.monotonic() - began
    return output, usage.ru_utime + usage.ru_stime, wall, usage.ru_maxrss / 1024


def row(what, command, bar):
    output, cpu, wall, memory = measured(command)
    found = EXPLORED.search(output)
    if not found:
        print(f"{what}: {shown(command)}\n  FAILED: {output[-400:]}")
        return None
    states, periods = (int(number.replace(",", "")) for number in found.group(1, 2))
    print(f"{what}: {shown(command)}")
    print(
        f"  {states:,} states, {periods:,} periods, {found.group(3)}: {cpu:.2f} s of processor ({wall:.2f} s wall), "
        f"{memory:.0f} MB, {periods / cpu:,.0f} periods a second; bar: {bar}"
    )
    return states, periods, memory


def shown(command):
    return " ".join(os.path.relpath(part, ROOT) if part.startswith(ROOT) else part for part in command)


def promela(aut):
    """One process that goes from state to state as the graph does."""
    following = {}
    for line in open(aut).read().splitlines()[1:]:
        source, rest = line[1:].split(",", 1)
        following.setdefault(int(source), []).append(int(rest.rsplit(",", 1)[1].rstrip(")")))
    states = set(following) | {to for targets in following.values() for to in targets}
    lines = ["byte unused;", "active proctype mission() {", "goto S0;"]
    for state in sorted(states):
        ways = following.get(state)
        if ways:
            lines.append(f"S{state}: if " + " ".join(f":: goto S{to}" for to in ways) + " fi;")
        else:
            lines.append(f"S{state}: goto end;")
    return "\n".join([*lines, "end: skip", "}"]) + "\n"


def spin(sentree, project, folder):
    """What SPIN needs for the graph of a project."""
    graph = os.path.join(folder, "graph.aut")
    subprocess.run(
        [sentree, "verify", project, "--faults", "none", "--graph", graph, "--out", folder],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        check=False,
    )
    with open(os.path.join(folder, "graph.pml"), "w") as file:
        file.write(promela(graph))
    try:
        subprocess.run(["spin", "-a", "graph.pml"], cwd=folder, check=True, capture_output=True, timeout=300)
        subprocess.run(
            ["gcc", "-O0", "-w", "-DSAFETY", "-o", "pan", "pan.c"], cwd=folder, check=True, timeout=600
        )
    except (subprocess.SubprocessError, OSError) as error:
        print(f"  SPIN: {error}")
        return
    output, cpu, wall, memory = measured([os.path.join(folder, "pan"), "-m1000000"])
    stored = re.search(r"([\d.e+]+) states, stored", output)
    print(
        f"  SPIN on that graph: {stored.group(1) if stored else '?'} states, {cpu:.2f} s of processor ({wall:.2f} s "
        f"wall), {memory:.0f} MB, once it has been told each state and period"
    )


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sentree = os.path.abspath(sys.argv[1])
    recharge = os.path.join(EXAMPLES, "recharge")
    porter = os.path.join(EXAMPLES, "porter")
    with tempfile.TemporaryDirectory() as folder:
        out = ["--out", os.path.join(folder, "out")]
        none = ["--faults", "none"]
        row("every requirement of recharge", [sentree, "verify", recharge, *none, *out], "0.3 s")
        if shutil.which("spin") and shutil.which("gcc"):
            spin(sentree, recharge, folder)
        else:
            print("  SPIN is not installed: apt-get install spin")
        row("the same, every step executed", [sentree, "verify", recharge, *none, "--no-memo", *out], "50,000 a second")
        # Of a project that is where it finds its counterexamples, as a person has it.
        own = os.path.join(folder, "recharge")
        shutil.copytree(recharge, own)
        first = [sentree, "verify", own, *none, "--only", "never_empty", "--order", "virtual"]
        row("the first counterexample of never_empty", first, "0.1 s")
        many = [sentree, "verify", porter, "--order", "virtual"]
        found = row("many states", [*many, *out], "5 s, 250,000 periods a second, 100 MB")
        few = row("their beginning", [*many, "--ticks", "1", *out], "none: what the program needs anyway")
        if found and few:
            each = (found[2] - few[2]) * 1e6 / found[0]
            print(f"  {each:.0f} bytes for each state, with its periods and what two requirements make of them; bar: 64 for itself")
        for more in ([], ["--all-orders"]):
            row("orders", [sentree, "verify", os.path.join(EXAMPLES, "warehouse"), *more, *out], "none")
        every = [sentree, "verify", porter, "--all-orders", "--states", "40000", *out]
        row("many periods", every, "250,000 periods a second")
        for threads in ("1", "2"):
            row("in threads", [sentree, "verify", porter, "--threads", threads, *out], "none: wall time tells")
        guard = os.path.join(EXAMPLES, "guard")
        row("a tree of 2,088 elements", [sentree, "verify", guard, *out], "2 s")
        runs = 20_000
        for threads in (1, 2):
            command = ["verify", recharge, *none, "--runs", str(runs), "--ticks", "100", "--threads", str(threads)]
            output, cpu, wall, _ = measured([sentree, *command])
            print("statistics: sentree " + shown(command))
            if f"{runs} runs of" in output:
                print(
                    f"  {runs / cpu:,.0f} runs of 100 ticks a second of processor, {runs / wall:,.0f} of wall time; bar: "
                    f"5,000\n  {100 * runs / cpu:,.0f} ticks a second, remembered; bar: 1,000,000"
                )
            else:
                print(f"  FAILED: {output[-400:]}")
        # The simulated robot, 67 s of it in each run.
        runs = 20
        command = ["campaign", recharge, "-n", str(runs), "--jobs", "1", "--no-shrink"]
        _, cpu, wall, _ = measured([sentree, *command, "--out", os.path.join(folder, "campaign")])
        print("statistics with the simulated robot: sentree " + shown(command))
        print(f"  {runs / cpu:.1f} runs a second and core ({wall:.1f} s wall); bar: 10")
    print(f"largest memory of any: {resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
