#!/usr/bin/env python3
"""lint_test.py LINT: what `lint.py tidy` leaves for later, and where that is a failure. clang-tidy is played by a script."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

lint = Path(sys.argv[1])


def check(what, holds):
    if not holds:
        sys.exit(f"not so: {what}")


with tempfile.TemporaryDirectory() as name:
    root = Path(name).resolve()
    (root / "scripts").mkdir()
    shutil.copy(lint, root / "scripts/lint.py")
    (root / "src/a").mkdir(parents=True)
    (root / ".clang-tidy").write_text("")
    programs = root / "programs"
    programs.mkdir()
    tidy = programs / "clang-tidy"
    tidy.write_text("#!/bin/sh\necho 'LLVM version 14.0.6'\n")
    tidy.chmod(0o755)
    environment = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}", "GIT_CONFIG_GLOBAL": "/dev/null", "GIT_CONFIG_NOSYSTEM": "1"}
    environment.pop("CI", None)

    def git(*arguments):
        subprocess.run(["git", "-c", "user.name=t", "-c", "user.email=t@example.org", *arguments], cwd=root, env=environment, check=True, capture_output=True)

    def run(*, seconds=0, **more):
        command = [sys.executable, root / "scripts/lint.py", "tidy", root / "build", "--seconds", str(seconds)]
        return subprocess.run(command, env={**environment, **more}, capture_output=True, text=True)

    build = root / "build"
    build.mkdir()
    entries = []
    for one in ("changed", "other"):
        (root / f"src/a/{one}.cpp").write_text(f"int {one};\n")
        file = str(root / f"src/a/{one}.cpp")
        entries.append({"file": file, "directory": str(build), "command": f"c++ -std=c++20 -o src/{one}.dir/{one}.o -c {file}"})
    (build / "compile_commands.json").write_text(json.dumps(entries))
    (root / ".gitignore").write_text("build\nprograms\n")
    git("init", "-q", "-b", "main")
    git("add", ".")
    git("commit", "-q", "-m", "first")
    git("update-ref", "refs/remotes/origin/main", "HEAD")
    (root / "src/a/changed.cpp").write_text("int changed = 1;\n")
    git("commit", "-q", "-a", "-m", "second")

    done = run()
    check("here nothing is begun when the time is over", done.returncode == 0 and "0 of 1 that have changed" in done.stdout)
    check("what has changed and waits is named", "of those that have changed: src/a/changed.cpp" in done.stdout)
    done = run(CI="true")
    check("in CI what has changed is examined all the same", done.returncode == 0 and "1 of 1 that have changed" in done.stdout)
    check("in CI what has not may wait", "1 sources have not been examined" in done.stdout)

    # CI runs what has been pushed: nothing differs from origin/main.
    git("update-ref", "refs/remotes/origin/main", "HEAD")
    (root / "src/a/other.cpp").write_text("int other = 1;\n")
    git("commit", "-q", "-a", "-m", "third")
    git("update-ref", "refs/remotes/origin/main", "HEAD")
    done = run(CI="true")
    check("what has been pushed counts as changed", "src/a/other.cpp" not in done.stdout and "2 are known to be good" in done.stdout)

    # A source that does not come to an end is not examined.
    text = (root / "scripts/lint.py").read_text()
    (root / "scripts/lint.py").write_text(text.replace("HANGS_AFTER_S = 900", "HANGS_AFTER_S = 0.01"))
    tidy.write_text("#!/bin/sh\necho 'LLVM version 14.0.6'\ncase \"$*\" in *--quiet*) read -r forever;; esac\n")
    (root / "src/a/changed.cpp").write_text("int changed = 2;\n")
    check("in CI what could not be examined is a failure", run(CI="true").returncode == 1)
    check("here it is not", run().returncode == 0)
