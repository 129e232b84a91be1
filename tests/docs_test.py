#!/usr/bin/env python3
"""Executes what the documentation says, as it is written.

usage: docs_test.py SENTREE SOURCE_DIR WORK_DIR FILE.md …      (PREFIX of an installation in $CMAKE_PREFIX_PATH)

In fenced blocks a line `$ COMMAND` is executed by bash. Lines that end in a backslash go on. What follows is its output, line by
line; `…` stands for any text, alone on a line for any lines. Commands that end with something other than 0 say so in an HTML
comment before the block, with one number a command:

    <!-- exit 1 -->
    <!-- not run: why -->     only its options are compared with the help of the command
    <!-- run COMMAND -->      is executed before the block, unseen by readers
    <!-- beside: TEXT -->     goes on until the end of the file, where it must still go on; what follows waits until it says TEXT
    <!-- file PATH -->        the block is written to that file; a `run` behind it finds it there

Blocks without `$` list commands. A line `sentree …` of theirs is executed where its files are there (RUN.mcap is a recording,
my_robot a new project), it ends by itself, and names no placeholder; findings (1) are no failure then. Else, as with what is not
run, its command and options are compared with the help.

All blocks of one file are executed in one folder: for the steps of the tutorial that of a copy of it, in which they follow each
other, else one that has examples/, interfaces/ and docs/ of the repository.
"""

import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

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
        starts = line.startswith("$ ") if transcript else re.match(r"sentree ", line)
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
            parts = [re.escape(re.sub(r"\s+", " ", part)) for part in re.sub(r"(?<=\S) *… *", "…", line.rstrip()).split("…")]
            pattern += "[^\n]*".join(parts) + "\n"
    text = "".join(re.sub(r"[ \t]+", " ", line.rstrip()) + "\n" for line in got)
    return re.fullmatch(pattern + r"(?:\s*)", text) is not None


# These serve until they are ended, need a run that goes on or somebody else, or take minutes.
LASTING = {"studio", "lsp", "watch", "sim", "component", "skill", "echo", "ping", "services", "call", "campaign", "bench", "import", "completion", "chart"}
LIVE = {"--studio", "--live", "--groot", "--open", "--processes", "--yarp-server", "--yarp", "--ros", "--listen"}


def can_be_executed(command, folder):
    words = command.split("#")[0].replace("'", "").replace('"', "").split()
    if words[0] != "sentree" or len(words) < 2 or words[1] in LASTING or LIVE & {word.split("=")[0] for word in words}:
        return False
    if re.search(r"[…|<>\[\]]", " ".join(words)) or (words[1] == "run" and "virtual" not in words):
        return False
    if words[1] == "verify" and "none" not in words:
        return False
    for before, word in zip(words[1:], words[2:]):
        if before in ("-o", "--output", "--record", "--out"):
            continue
        if word.split(".")[0].isupper() and word != "RUN.mcap":
            return False
        if re.search(r"/|\.[a-z]+$", word) and not word.startswith("-") and not os.path.exists(os.path.join(folder, word)):
            return False
        if before in ("check", "test", "verify", "run", "fmt", "graph", "model", "diff") and not word.startswith("-") and not os.path.exists(os.path.join(folder, word)):
            return False
    return True


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
        self.beside = []  # what goes on: (line, command, process, its output)
        if not step:
            self.execute("sentree run examples/recharge --scenario experiment1 --clock virtual --record RUN.mcap; sentree init my_robot; rm -rf runs")

    def say(self, line, what):
        self.failures += 1
        print(f"✗ {self.file}:{line}: {what}")

    def execute(self, command):
        shell = subprocess.Popen(["bash", "-c", command], cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL,
                                 stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True)
        try:
            said = shell.communicate(timeout=LIMIT_S)[0].splitlines()
            return shell.returncode, said
        except subprocess.TimeoutExpired:
            os.killpg(shell.pid, signal.SIGKILL)
            return "nothing: it does not end", shell.communicate()[0].splitlines()

    def go_on(self, line, command, text):
        """Begins a command beside the others, and waits until it says that."""
        output = tempfile.TemporaryFile(mode="w+")
        shell = subprocess.Popen(["bash", "-c", "exec " + command], cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL,
                                 stdout=output, stderr=subprocess.STDOUT, start_new_session=True)
        self.beside.append((line, command, shell, output))
        end = time.monotonic() + LIMIT_S
        while text not in self.said(output):
            if shell.poll() is not None or time.monotonic() > end:
                self.say(line, f"{command}\n  does not say {text!r} but\n    " + self.said(output))
                return
            time.sleep(0.05)
        self.executed += 1

    @staticmethod
    def said(output):
        output.seek(0)
        return output.read()

    def end(self):
        """Ends what goes on beside, which nothing has ended before."""
        for line, command, shell, output in reversed(self.beside):
            if shell.poll() is not None:
                self.say(line, f"{command}\n  ended too early, with {shell.returncode}:\n    " + self.said(output))
                continue
            shell.send_signal(signal.SIGINT)
            try:
                shell.wait(LIMIT_S)
            except subprocess.TimeoutExpired:
                os.killpg(shell.pid, signal.SIGKILL)
                shell.wait()
                self.say(line, f"{command}\n  does not end when it is interrupted")
        self.beside = []

    def block(self, line, comments, lines):
        expected_codes, why_not, is_file = [], None, False
        for comment in comments:
            word, _, rest = comment.partition(" ")
            if word == "exit":
                expected_codes = [int(number) for number in rest.split()]
            elif comment.startswith("not run:"):
                why_not = comment[8:].strip()
            elif word == "file":
                with open(os.path.join(self.folder, rest), "w", encoding="utf-8") as out:
                    out.write("\n".join(lines) + "\n")
                is_file = True
            elif word == "beside:":
                for command, _ in commands(lines):
                    self.go_on(line, command, rest)
                return
            elif word == "run":
                code, got = self.execute(rest)
                if code != 0:
                    self.say(line, f"{rest}\n    ended with {code}: " + "\n    ".join(got[-5:]))
        for number, (command, expected) in enumerate([] if is_file else commands(lines)):
            listed = expected is None
            if why_not is not None or (listed and not can_be_executed(command, self.folder)):
                self.left_out += 1
                self.options(line, command)
                continue
            code, got = self.execute(command)
            self.executed += 1
            if listed and number >= len(expected_codes):
                if code not in (0, 1):
                    self.say(line, f"{command}\n    ended with {code}:\n    " + "\n    ".join(got[-8:]))
                continue
            wanted = expected_codes[number] if number < len(expected_codes) else 0
            if code != wanted:
                self.say(line, f"$ {command}\n    ended with {code}, not {wanted}:\n    " + "\n    ".join(got[-8:]))
            elif expected and any(text.strip() for text in expected) and not matches(expected, got):
                self.say(line, f"$ {command}\n  says\n    " + "\n    ".join(got[:60]))

    def options(self, line, command):
        words = command.split("#")[0].replace("[", " ").replace("]", " ").split()
        if len(words) < 2 or words[0] != "sentree":
            return
        known = help_of(words)
        if not known and not words[1].startswith("-"):
            self.say(line, f"{command}: there is no command {words[1]}")
        for word in words:
            option = re.match(r"--[a-z][a-z-]*", word)
            if option and not re.search(re.escape(option[0]) + r"(?![a-z-])", known):
                self.say(line, f"{command}: there is no option {option[0]}")


def main():
    failures = executed = left_out = 0
    for file in map(os.path.abspath, sys.argv[4:]):
        with open(file, encoding="utf-8") as text:
            found = list(blocks(text.read()))
        if not any(commands(lines) for _, _, lines in found):
            continue
        page = Page(file)
        try:
            for line, comments, lines in found:
                page.block(line, comments, lines)
        finally:
            page.end()
        if page.executed or page.left_out:
            print(f"{page.file}: {page.executed} executed, {page.left_out} not run", flush=True)
        failures, executed, left_out = failures + page.failures, executed + page.executed, left_out + page.left_out
        if not page.failures and not page.keep:
            shutil.rmtree(page.folder)
    print(f"{executed} commands executed, {left_out} only compared with the help, {failures} failures")
    if executed + left_out == 0:
        print("✗ no commands were found")
        return 1
    return 1 if failures else 0


sys.exit(main())
