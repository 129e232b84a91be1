#!/usr/bin/env python3
"""Checks the C++ sources: lint.py format BUILD for their form, lint.py names BUILD for names that hide one another,
lint.py tidy BUILD for what .clang-tidy names.

What has been found good is not examined again while it, the settings and the tool are the same; the record lies in
BUILD/lint.

Exit code: 0, 1 findings, 77 the tool is not installed, or this is no checkout of git.
"""

import argparse
import hashlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
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
        print(f"{name} {VERSION} is not installed; other versions find other things")
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


# Several sources of a target are examined as one, because most of the time goes into the headers.
BATCH = 24
# Where there is nothing to compare with, what these last commits have changed comes first.
COMMITS = 20
HANGS_AFTER_S = 900

INCLUDED = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.M)


def commands(build):
    """Of each source that the build compiles, alone or as part of several: its target and the options that matter."""
    found = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        file = Path(entry["file"])
        is_united = "Unity" in file.parts
        files = [Path(name) for name in INCLUDED.findall(file.read_text())] if is_united else [file]
        words = shlex.split(entry["command"])
        options = [one for at, one in enumerate(words) if one.startswith(("-I", "-D", "-std=")) or "-isystem" in words[at - 1:at + 1]]
        target = str(file.parent.parent if is_united else Path(words[words.index("-o") + 1]).parent)
        for one in files:
            if one.is_relative_to(ROOT) and one.suffix == ".cpp" and one.is_file():
                found.setdefault(str(one.relative_to(ROOT)), (target, options))
    return found


class Headers:
    """What a source includes of this repository, directly or not."""

    def __init__(self):
        self.direct = {}

    def included(self, name):
        if name not in self.direct:
            here, found = Path(name).parent, set()
            for what in INCLUDED.findall((ROOT / name).read_text()):
                for path in (ROOT / here / what, ROOT / "include" / what):
                    if path.is_file() and path.resolve().is_relative_to(ROOT):
                        found.add(str(path.resolve().relative_to(ROOT)))
                        break
            self.direct[name] = found
        return self.direct[name]

    def of(self, source):
        found, open_ones = set(), [source]
        while open_ones:
            for name in self.included(open_ones.pop()) - found:
                found.add(name)
                open_ones.append(name)
        return found


def git(*arguments):
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True)
    return done.stdout.split() if done.returncode == 0 else []


def changed_files():
    """Since the branch left origin/main; without that, or where it has not left it, in the last commits. What is not committed counts."""
    base = git("merge-base", "HEAD", "origin/main")
    if not base or base == git("rev-parse", "HEAD"):
        base = git("rev-list", "-n", "1", f"--skip={COMMITS}", "HEAD") or git("rev-list", "--max-parents=0", "HEAD")[:1]
    return set(git("diff", "--name-only", *base) + git("ls-files", "--others", "--exclude-standard"))


def wanted_first(all_sources, headers):
    """Sources that have changed, and for each header that has one that includes it; then the others, each time from another place."""
    changed = changed_files()
    first = [name for name in all_sources if name in changed]
    for header in sorted(name for name in changed if name.endswith(".h")):
        users = [name for name in all_sources if header in headers[name]]
        if users and not any(name in first for name in users):
            first.append(next((name for name in users if Path(name).stem == Path(header).stem), users[0]))
    rest = [name for name in all_sources if name not in first]
    turn = int((git("rev-parse", "HEAD") or ["0"])[0][:8], 16) % max(1, len(rest))
    return first, rest[turn:] + rest[:turn]


def batches(names, targets):
    by_target = {}
    for name in names:
        by_target.setdefault(targets[name][0], []).append(name)
    return [some[at:at + BATCH] for some in by_target.values() for at in range(0, len(some), BATCH)]


def examine(program, names, options):
    """What clang-tidy says of these sources; nothing if they are good. None: it does not come to an end."""
    with tempfile.TemporaryDirectory() as folder:
        unit = Path(folder) / "several.cpp"
        unit.write_text("".join(f'#include "{ROOT / name}"\n' for name in names))
        command = [program, "--quiet", f"--config-file={ROOT / '.clang-tidy'}", str(unit), "--", *options, "-w"]
        try:
            done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=HANGS_AFTER_S)
        except subprocess.TimeoutExpired:
            return None
    if done.returncode == 0:
        return ""
    # Sources that are not compiled as one anyway may hide names of one another, and clang-tidy 14 may crash on many.
    if len(names) > 1 and ("[clang-diagnostic-error" in done.stdout or "Stack dump:" in done.stderr):
        half = (len(names) + 1) // 2
        said = [examine(program, some, options) for some in (names[:half], names[half:])]
        return None if None in said else "".join(said)
    return done.stdout or done.stderr


def check_tidy(build, folders, every, seconds, strict):
    """`strict`: what has changed is examined however long it takes, or is a finding."""
    program, version = tool("clang-tidy")
    settings = (ROOT / ".clang-tidy").read_text()
    # Not tests: they do on purpose what is a mistake elsewhere, and the headers of GoogleTest take longest.
    ours = {name for name in sources() if name.startswith("src/") and not name.endswith("_test.cpp")}
    targets = {name: one for name, one in commands(build).items() if name in ours}
    if folders:
        targets = {name: one for name, one in targets.items() if name.startswith(tuple(folders))}
    if not targets:
        print(f"{build} compiles none of these sources")
        return 1
    closure = Headers()
    headers = {name: closure.of(name) for name in targets}
    hashes = {name: digest((ROOT / name).read_text()) for name in set(targets).union(*headers.values())}
    keys = {name: digest(version, settings, *targets[name][1], name, hashes[name], *(hashes[one] for one in sorted(headers[name]))) for name in targets}
    record = Record(build / "lint" / "tidy")
    first, rest = wanted_first(sorted(targets), headers)
    queue = [batch for part in (first, rest) for batch in batches([name for name in part if keys[name] not in record.known], targets)]

    started, examined, findings = time.monotonic(), [], 0

    def work(batch):
        is_due = every or (strict and batch[0] in first)
        if not is_due and time.monotonic() - started > seconds:
            return batch, None
        return batch, examine(program, batch, targets[batch[0]][1])

    with ThreadPoolExecutor(2) as pool:
        for batch, said in pool.map(work, queue):
            if said is None:
                continue
            examined += batch
            if said:
                findings += 1
                print(said, flush=True)
                continue
            record.good.update(keys[name] for name in batch)
            if every:
                record.keep(record.known)
    record.keep(set(keys.values()) if not folders else record.known)
    left = [name for name in first + rest if keys[name] not in record.known and name not in examined]
    print(f"{len(examined)} of {len(targets)} sources examined in {time.monotonic() - started:.0f} s: {len(set(examined) & set(first))} of {len(first)} that have changed; "
          f"{sum(keys[name] in record.known | record.good for name in targets)} are known to be good")
    waiting = [name for name in left if name in first]
    if left:
        print(f"{len(left)} sources have not been examined; lint.py tidy BUILD --all does that" + ("; of those that have changed: " + " ".join(waiting) if waiting else ""))
    return 1 if findings or (strict and waiting) else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["format", "names", "tidy"])
    parser.add_argument("build", type=Path)
    parser.add_argument("folders", nargs="*", help="tidy: only these, all of them")
    parser.add_argument("--all", action="store_true", help="tidy: everything, however long it takes")
    parser.add_argument("--seconds", type=float, default=60, help="tidy: after these no further sources are begun; with CI in the environment, none that have not changed")
    arguments = parser.parse_args()
    if arguments.what == "tidy":
        return check_tidy(arguments.build.resolve(), arguments.folders, arguments.all or bool(arguments.folders), arguments.seconds, bool(os.environ.get("CI")))
    return check_names() if arguments.what == "names" else check_format(arguments.build)


if __name__ == "__main__":
    sys.exit(main())
