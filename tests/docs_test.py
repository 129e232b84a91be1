#!/usr/bin/env python3
"""Executes what the documentation says, as it is written.

usage: docs_test.py SENTREE SOURCE_DIR WORK_DIR FILE.md …      (PREFIX of an installation in $CMAKE_PREFIX_PATH)

In fenced blocks a line `$ COMMAND` is executed by bash, and so is a line `sentree …` in a block without such lines. Lines that
end in a backslash go on. What follows a `$ COMMAND` is its output, line by line; `…` stands for any text, alone on a line for
any lines. Commands that end with something other than 0 say so in an HTML comment before the block, with one number a command:

    <!-- exit 1 -->
    <!-- not run: why -->     only its options are compared with the help of the command
    <!-- run COMMAND -->      is executed before the block, unseen by readers

All blocks of one file are executed in one folder: for the steps of the tutorial that of a copy of it, in which they follow each
other, else one that has examples/, interfaces/ and docs/ of the repository.
"""

import os
import re
import shutil
import subprocess
import sys

LIMIT_S = 120
SENTREE, SOURCE, WORK = (os.path.abspath(path) for path in sys.argv[1:4])


def blocks(text):
    """Yields (line number, comments before it, lines) of each fenced block."""
    comments, fence, body, at = [], None, [], 0
    for number, line in enumerate(text.splitlines(), 1):
        stripped = line.strip()
        if fence is not None:
            if stripped == "```":
                yield at, comments, body
                comments, fence, body = [], None, []
            else:
                body.append(line[fence:] if not line[:fence].strip() else line)
        elif stripped.startswith("```"):
            fence, at = len(line) - len(line.lstrip()), number
        elif re.fullmatch(r"<!--.*-->", stripped):
            comments.append(stripped[4:-3].strip())
        elif stripped:
            comments = []


def commands(lines):
    """The (command, expected lines or None) of a block."""
    transcript = any(line.startswith("$ ") for line in lines)
    found, i = [], 0
    while i < len(lines):
        line = lines[i]
        i += 1
        starts = line.startswith("$ ") if transcript else re.match(r"(sentree|\./(demo|test)) ", line)
        if not starts:
            if found and transcript:
                found[-1][1].append(line)
            continue
        command = line[2:] if transcript else line
        while command.endswith("\\") and i < len(lines):
            command = command[:-1] + " " + lines[i].strip()
            i += 1
        found.append((command, [] if transcript else None))
    return found


def matches(expected, got):
    """Whether the lines fit; `…` alone stands for any lines."""
    pattern = ""
    for line in expected:
        if line.strip() == "…":
            pattern += r"(?:[^\n]*\n)*?"
        else:
            parts = [re.escape(re.sub(r"\s+", " ", part)) for part in line.rstrip().split("…")]
            pattern += "[^\n]*".join(parts) + "\n"
    text = "".join(re.sub(r"[ \t]+", " ", line.rstrip()) + "\n" for line in got)
    return re.fullmatch(pattern + r"(?:\s*)", text) is not None


def help_of(words):
    for count in (2, 1):
        names = [word for word in words[1:] if re.fullmatch(r"[a-z][a-z-]*", word)][:count]
        said = subprocess.run([SENTREE, *names, "--help"], capture_output=True, text=True, stdin=subprocess.DEVNULL)
        if said.returncode == 0:
            return said.stdout
    return ""


class Page:
    def __init__(self, file):
        self.file = os.path.relpath(file, SOURCE)
        ignore = shutil.ignore_patterns("build", "node_modules", "runs", "verify", "campaign", "__pycache__")
        step = re.match(r"docs/tutorial/(.+)/", self.file)
        self.keep = step is not None  # later steps use what an earlier one has built
        if step:
            tutorial = os.path.join(WORK, "tutorial")
            if step[1].startswith("1-"):
                shutil.rmtree(tutorial, ignore_errors=True)
                shutil.copytree(os.path.join(SOURCE, "docs/tutorial"), tutorial, ignore=ignore)
            self.folder = os.path.join(tutorial, step[1])
        else:
            self.folder = os.path.join(WORK, re.sub(r"[^A-Za-z0-9]+", "-", self.file))
            shutil.rmtree(self.folder, ignore_errors=True)
            os.makedirs(self.folder)
            for folder in ("examples", "interfaces", "docs"):
                shutil.copytree(os.path.join(SOURCE, folder), os.path.join(self.folder, folder), ignore=ignore)
        runtime = os.path.join(WORK, "run")
        os.makedirs(runtime, mode=0o700, exist_ok=True)
        self.environment = dict(os.environ, PATH=os.path.dirname(SENTREE) + ":" + os.environ["PATH"], XDG_RUNTIME_DIR=runtime,
                                NO_COLOR="1", SOURCE=SOURCE)
        self.environment.pop("SENTREE_RUNS", None)
        self.failures = self.executed = self.left_out = 0

    def say(self, line, what):
        self.failures += 1
        print(f"✗ {self.file}:{line}: {what}")

    def execute(self, command):
        try:
            done = subprocess.run(["bash", "-c", command], cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=LIMIT_S)
            return done.returncode, done.stdout.splitlines()
        except subprocess.TimeoutExpired as late:
            return "nothing: it does not end", (late.stdout or b"").decode(errors="replace").splitlines()

    def block(self, line, comments, lines):
        expected_codes, why_not = [], None
        for comment in comments:
            word, _, rest = comment.partition(" ")
            if word == "exit":
                expected_codes = [int(number) for number in rest.split()]
            elif comment.startswith("not run:"):
                why_not = comment[8:].strip()
            elif word == "run":
                code, got = self.execute(rest)
                if code != 0:
                    self.say(line, f"{rest}\n    ended with {code}: " + "\n    ".join(got[-5:]))
        for number, (command, expected) in enumerate(commands(lines)):
            if why_not is not None:
                self.left_out += 1
                self.options(line, command)
                continue
            code, got = self.execute(command)
            self.executed += 1
            wanted = expected_codes[number] if number < len(expected_codes) else 0
            if code != wanted:
                self.say(line, f"$ {command}\n    ended with {code}, not {wanted}:\n    " + "\n    ".join(got[-8:]))
            elif expected and any(text.strip() for text in expected) and not matches(expected, got):
                self.say(line, f"$ {command}\n  says\n    " + "\n    ".join(got[:60]))

    def options(self, line, command):
        words = command.split("#")[0].split()
        if not words or words[0] != "sentree":
            return
        known = help_of(words)
        for word in words:
            option = re.match(r"--[a-z][a-z-]*", word)
            if option and not re.search(re.escape(option[0]) + r"(?![a-z-])", known):
                self.say(line, f"{command}: there is no option {option[0]}")


def main():
    failures = executed = left_out = 0
    for file in map(os.path.abspath, sys.argv[4:]):
        page = Page(file)
        with open(file, encoding="utf-8") as text:
            for line, comments, lines in blocks(text.read()):
                page.block(line, comments, lines)
        if page.executed or page.left_out:
            print(f"{page.file}: {page.executed} executed, {page.left_out} not run")
        failures, executed, left_out = failures + page.failures, executed + page.executed, left_out + page.left_out
        if not page.failures and not page.keep:
            shutil.rmtree(page.folder)
    print(f"{executed} commands executed, {left_out} only compared with the help, {failures} failures")
    if executed + left_out == 0:
        print("✗ no commands were found")
        return 1
    return 1 if failures else 0


sys.exit(main())
