#!/usr/bin/env python3
"""Checks the C++ sources: lint.py format BUILD for their form, lint.py names BUILD for names that hide one another.

What has been found good is not examined again while it, the settings and the tool are the same; the record lies in
BUILD/lint.

Exit code: 0, 1 findings, 77 the tool is not installed, or this is no checkout of git.
"""

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VERSION = 14


def sources():
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "*.cpp", "*.h"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        print("not a checkout of git: nobody knows which sources are ours")
        sys.exit(77)
    listed = done.stdout.split("\0")
    return sorted(name for name in set(listed) if name and (ROOT / name).is_file())


def tool(name):
    path = shutil.which(name)
    version = subprocess.run([path, "--version"], capture_output=True, text=True).stdout if path else ""
    if f"version {VERSION}." not in version:
        print(f"{name} {VERSION} is not installed; other versions write some lines differently")
        sys.exit(77)
    return path, version


class Record:
    """Hashes of what has been found good; those of this checkout only, so that it does not grow."""

    def __init__(self, path):
        self.path = path
        self.known = set(path.read_text().split()) if path.exists() else set()
        self.good = set()

    def keep(self, wanted):
        self.path.parent.mkdir(parents=True, exist_ok=True)
        beside = self.path.with_suffix(f".{os.getpid()}")
        beside.write_text("\n".join(sorted(self.good | (self.known & wanted))) + "\n")
        beside.replace(self.path)


def digest(*parts):
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def check_format(build):
    program, version = tool("clang-format")
    settings = (ROOT / ".clang-format").read_text()
    record = Record(build / "lint" / "format")
    keys = {name: digest(version, settings, name, (ROOT / name).read_text()) for name in sources()}
    new = [name for name, key in keys.items() if key not in record.known]
    wrong = []
    for first in range(0, len(new), 50):
        batch = new[first:first + 50]
        command = [program, "--dry-run", "-Werror", "--ferror-limit=3"]
        if subprocess.run([*command, *batch], cwd=ROOT).returncode == 0:
            record.good.update(keys[name] for name in batch)
            continue
        for name in batch:
            if subprocess.run([*command, name], cwd=ROOT, stderr=subprocess.DEVNULL).returncode == 0:
                record.good.add(keys[name])
            else:
                wrong.append(name)
    record.keep(set(keys.values()))
    print(f"{len(new)} of {len(keys)} files examined")
    if wrong:
        print("not as clang-format writes it; run: clang-format -i " + " ".join(wrong))
    return 1 if wrong else 0


# A function in an anonymous namespace: its name, and its parameters if they end in the same line.
LOCAL = re.compile(r"^(?!return|else|using|class|struct|enum|TEST)(?:[\w:<>,&*\[\]]+ )+[&*]*(\w+)\(([^;]*?)\)[^;()]*\{")


def counts_of_arguments(parameters):
    """How many arguments such a function may be called with."""
    parameters = re.sub(r"<[^<>]*>", "", re.sub(r"<[^<>]*>", "", parameters))
    each = [one for one in parameters.split(",") if one.strip()]
    return range(len([one for one in each if "=" not in one]), len(each) + 1)


def check_names():
    """Where several sources of a library are compiled as one, a call takes the function of another source if that fits better, and nobody is told."""
    there = {}
    for name in sources():
        if not name.startswith("src/") or not name.endswith(".cpp") or name.endswith("_test.cpp"):
            continue
        is_local = False
        for line in re.sub(r",\n\s+", ", ", (ROOT / name).read_text()).split("\n"):
            if line.startswith("namespace {") or line == "}  // namespace":
                is_local = line.startswith("namespace {")
            elif is_local and (found := LOCAL.match(line)):
                for count in counts_of_arguments(found[2]):
                    there.setdefault((str(Path(name).parent), found[1], count), set()).add(name)
    clashes = {(function, *sorted(files)) for (_, function, _), files in there.items() if len(files) > 1}
    for function, *files in sorted(clashes):
        print(f"{function}: in {', '.join(files)}; give each another name")
    print(f"{len(there)} functions in anonymous namespaces")
    return 1 if clashes else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["format", "names"])
    parser.add_argument("build", type=Path)
    arguments = parser.parse_args()
    return check_names() if arguments.what == "names" else check_format(arguments.build)


if __name__ == "__main__":
    sys.exit(main())
