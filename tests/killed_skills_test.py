#!/usr/bin/env python3
"""Skills whose processes are killed from outside at random moments: the recording replays as it happened.

usage: killed_skills_test.py SENTREE SOURCE_DIR WORK_DIR [RUNS [SEED]]
"""

import os
import random
import shutil
import signal
import subprocess
import sys

from restless import restless_recharge

KILLS = 5


class Test:
    def __init__(self, sentree, source, work):
        self.sentree, self.work = sentree, work
        shutil.rmtree(work, ignore_errors=True)
        os.makedirs(work)
        self.project = restless_recharge(source, work)

    def skills(self, run):
        """Processes of its skills that are alive."""
        found, children = [], []
        for thread in os.listdir(f"/proc/{run.pid}/task"):
            try:
                with open(f"/proc/{run.pid}/task/{thread}/children", encoding="ascii") as file:
                    children += file.read().split()
            except FileNotFoundError:
                continue
        for pid in children:
            try:
                with open(f"/proc/{pid}/cmdline", "rb") as file:
                    words = file.read().split(b"\0")
            except FileNotFoundError:
                continue
            if b"skill" in words[1:2]:
                found.append(int(pid))
        return found

    def run(self, seed):
        chance = random.Random(seed)
        print(f"seed {seed}", flush=True)
        recording = os.path.join(self.work, f"{seed}.mcap")
        run = subprocess.Popen([self.sentree, "run", self.project, "--processes", "--clock", "real", "--factor", "20",
                                "--duration", "80 s", "--verbose", "--record", recording],
                               stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                               errors="replace")
        seen = {"process.restarted": 0, ".unreachable": 0}
        killed, left = 0, chance.randrange(20, 4000)
        for line in run.stdout:
            for name in seen:
                seen[name] += name in line
            left -= 1
            if left > 0 or killed == KILLS:
                continue
            if skills := self.skills(run):
                os.kill(chance.choice(skills), signal.SIGKILL)
                killed += 1
            left = chance.randrange(20, 4000)
        run.wait()
        assert killed and seen["process.restarted"], (killed, seen)
        replay = subprocess.run([self.sentree, "replay", recording], capture_output=True, text=True, check=False)
        assert replay.returncode == 0, replay.stdout + replay.stderr
        print(f"✓ {killed} killed, {seen['.unreachable']} ticks not answered, replayed as recorded", flush=True)


if __name__ == "__main__":
    test = Test(*sys.argv[1:4])
    first = int(sys.argv[5]) if len(sys.argv) > 5 else random.randrange(1 << 32)
    for number in range(int(sys.argv[4]) if len(sys.argv) > 4 else 3):
        test.run(first + number)
