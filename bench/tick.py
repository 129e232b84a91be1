#!/usr/bin/env python3
"""How long a tick of the recharge mission takes, with its skills in threads and in processes of their own.

  bench/tick.py build/release/bin/sentree [SENTREE...]

With several programs they are measured in turns, so that they see the same machine. Prints the median tick of each run
in ms, the quickest of five runs, at 10 ticks a second, as the mission has them, and at rates at which caches stay warm.
"""
import json
import os
import subprocess
import sys
import tempfile

PROJECT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "examples", "recharge"))
RATES = (10, 100, 500)  # [Hz]
RUNS = 5
SECONDS = 4


def tick_ms(program, rate, options):
    with tempfile.TemporaryDirectory() as folder:
        scenario = os.path.join(folder, "tick.yaml")
        with open(scenario, "w", encoding="utf-8") as file:
            file.write(
                f"project: {PROJECT}\nclock: {{real: 1}}\noverride: {{mission: {{rate: {rate} Hz}}}}\nduration: {SECONDS} s\n"
            )
        run = subprocess.run(
            [program, "run", scenario, "--no-record", "--json", *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            check=False,
        )
        return json.loads(run.stdout.splitlines()[-1])["timing"]["tick_median_ms"]


def main():
    programs = [os.path.abspath(program) for program in sys.argv[1:]]
    if not programs:
        sys.exit(__doc__)
    print(f"{'rate':>8} {'skills in':>10}" + "".join(f" {os.path.relpath(program):>32}" for program in programs))
    for rate in RATES:
        for where, options in (("threads", ()), ("processes", ("--processes",))):
            best = [min(times) for times in zip(*[[tick_ms(p, rate, options) for p in programs] for _ in range(RUNS)])]
            print(f"{rate:>5} Hz {where:>10}" + "".join(f" {ms:>29.3f} ms" for ms in best), flush=True)


if __name__ == "__main__":
    main()
