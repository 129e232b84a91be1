#!/usr/bin/env python3
"""What docs/mutants.md says of the changes that no requirement notices is what `sentree verify --mutate` says.

usage: mutants_test.py SENTREE SOURCE_DIR
"""

import json
import os
import re
import subprocess
import sys

SENTREE, SOURCE = (os.path.abspath(path) for path in sys.argv[1:3])
ROW = re.compile(r"\| `(.+):(\d+)` \| `(.+)` \| (.+) \|$")


def told(example):
    """What the command says: how many of each fate, and those that nothing notices."""
    run = subprocess.run([SENTREE, "verify", f"examples/{example}", "--mutate", "--json"], cwd=SOURCE, stdout=subprocess.PIPE, check=True)
    found = json.loads(run.stdout)
    counts = found["counts"]
    line = (f"{len(found['mutants'])} changes: {counts['noticed']} noticed, {counts['not noticed']} not noticed, "
            f"{counts['same']} behave the same, {counts['refused']} refused.")
    assert counts["unknown"] == 0, counts
    return line, [(os.path.relpath(one["file"], f"examples/{example}"), one["line"], one["what"])
                  for one in found["mutants"] if one["fate"] == "not noticed"]


def written():
    """What the page says, by example."""
    with open(os.path.join(SOURCE, "docs/mutants.md"), encoding="utf-8") as file:
        sections = re.split(r"^## ", file.read(), flags=re.MULTILINE)[1:]
    for section in sections:
        lines = section.splitlines()
        rows = [match.groups() for match in map(ROW.match, lines) if match]
        yield lines[0], lines[2], [(path, int(line), what.replace("\\|", "|")) for path, line, what, _ in rows]


def main():
    failures = 0
    tried = 0
    for example, counts, rows in written():
        counts_told, rows_told = told(example)
        tried += len(rows_told)
        for what in sorted(set(rows) ^ set(rows_told)):
            print(f"{example}: {what} is {'only in docs/mutants.md' if what in rows else 'not in docs/mutants.md'}")
            failures += 1
        if counts != counts_told:
            print(f"{example}: docs/mutants.md says\n  {counts}\nthe command\n  {counts_told}")
            failures += 1
    if tried < 30:
        print(f"only {tried} changes are listed")
        failures += 1
    return min(failures, 1)


if __name__ == "__main__":
    sys.exit(main())
