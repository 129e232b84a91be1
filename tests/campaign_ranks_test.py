#!/usr/bin/env python3
"""One campaign, alone, by three ranks as a launcher starts them, and by three of which one dies.

usage: campaign_ranks_test.py SENTREE SOURCE_DIR WORK_DIR
"""

import json
import os
import shutil
import signal
import subprocess
import sys

RUNS = 15
RANKS = 3
PATIENCE_S = 300


def start(sentree, work, arguments, environment=None):
    return subprocess.Popen([sentree, "campaign", *arguments], cwd=work, env=dict(os.environ, **(environment or {})),
                            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def end(process):
    text, _ = process.communicate(timeout=PATIENCE_S)
    return process.returncode, text


def ranks(sentree, work, arguments, job):
    environment = {"OMPI_COMM_WORLD_SIZE": str(RANKS), "PMIX_NAMESPACE": job}
    return [start(sentree, work, [*arguments, "--mpi"], dict(environment, OMPI_COMM_WORLD_RANK=str(rank)))
            for rank in range(RANKS)]


def read(*path):
    with open(os.path.join(*path), "rb") as file:
        return file.read()


def main():
    sentree, source, work = (os.path.abspath(path) for path in sys.argv[1:4])
    shutil.rmtree(work, ignore_errors=True)
    os.makedirs(work)
    vary = os.path.join(work, "vary.yaml")
    with open(vary, "w", encoding="utf-8") as file:
        file.write("duration: 20 s\nparameters: {world.battery.initial: {uniform: [10 %, 100 %]}}\n")
    arguments = [os.path.join(source, "examples", "recharge"), "--vary", vary, "-n", str(RUNS), "--no-shrink"]

    code, text = end(start(sentree, work, [*arguments, "--out", "alone"]))
    assert code in (0, 1), text
    for name, job in (("together", "1"), ("again", "2")):
        running = ranks(sentree, work, [*arguments, "--out", "together"], job)
        told = [end(process) for process in running]
        assert [c for c, _ in told] == [code] + [0] * (RANKS - 1), told
        for file in ("runs.csv", "result.json"):
            assert read(work, "together", file) == read(work, "alone", file), f"{name}: {file} differs"
    print("✓ three ranks give what one process gives, byte for byte")

    # One dies before it can begin: it is stopped, and then killed, while the others run.
    running = ranks(sentree, work, [*arguments, "--out", "dying"], "3")
    dying = running[2]
    note = os.path.join(work, "dying", f"rank-3-of-{RANKS}", "rank.json")
    while dying.poll() is None and not os.path.exists(note):
        pass
    dying.send_signal(signal.SIGKILL)
    dying.wait()
    told = [end(process) for process in running[:2]]
    assert told[0][0] == 1 and "rank 3 of 3" in told[0][1] and "died" in told[0][1], told[0]
    result = json.loads(read(work, "dying", "result.json"))
    alone = read(work, "alone", "runs.csv").decode().splitlines()
    rows = read(work, "dying", "runs.csv").decode().splitlines()
    assert len(rows) == len(alone)
    lost = [number for number, row in enumerate(rows) if row != alone[number]]
    assert lost and all((number - 1) % RANKS == 2 for number in lost), lost
    assert all(",lost," in rows[number] for number in lost), rows
    assert result["lost"]["count"] == len(lost) and result["counted"] == RUNS - len(lost), result
    print(f"✓ a rank that dies costs its runs ({len(lost)}) and no other")

    code, text = end(start(sentree, work, [*arguments, "--mpi"]))
    assert code == 2 and "no launcher" in text, (code, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
