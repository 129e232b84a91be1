#!/usr/bin/env python3
"""`sentree check` finds no more in a tree after `sentree model TREE --into TREE` than before.

usage: model_into_test.py SENTREE SOURCE_DIR
Of the trees of this repository, and of public projects: $SENTREE_CORPUS, else shared/corpus beside it.
"""

import glob
import json
import os
import subprocess
import sys
import tempfile

sentree, source = (os.path.abspath(path) for path in sys.argv[1:3])
corpus = os.environ.get("SENTREE_CORPUS", source + "/../shared/corpus")
trees = [
    file
    for pattern in (corpus + "/bt/**/*.xml", source + "/examples/**/*.xml", source + "/tests/**/*.xml")
    for file in sorted(glob.glob(pattern, recursive=True))
    if b"<BehaviorTree" in open(file, "rb").read()
]
assert trees


def run(*arguments):
    return subprocess.run([sentree, *arguments], capture_output=True, text=True, timeout=120)


def findings(file, palettes):
    """Severity and code of each, sorted."""
    told = run("check", "--json", file, *palettes)
    return sorted((one["severity"], one["code"], one["message"]) for one in json.loads(told.stdout)["diagnostics"])


failures = 0
made = 0
for tree in trees:
    for palettes in ([], ["--palette", "nav2"]):
        with tempfile.TemporaryDirectory() as folder:
            copy = os.path.join(folder, os.path.basename(tree))
            with open(tree, "rb") as original, open(copy, "wb") as file:
                file.write(original.read())
            before = findings(copy, palettes)
            into = run("model", copy, "--into", copy, *palettes)
            if into.returncode != 0:
                continue  # no tree that can be read
            made += 1
            after = findings(copy, palettes)
            if len(after) > len(before):
                failures += 1
                print("FAIL", tree, palettes, *[one for one in after if one not in before], sep="\n  ", flush=True)
print(f"{made} models, {failures} with more findings than before")
sys.exit(1 if failures or not made else 0)
