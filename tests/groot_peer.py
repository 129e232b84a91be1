#!/usr/bin/env python3
"""groot_peer.py SENTREE SOURCE_DIR WORK_DIR: Groot 1 and Groot 2 as their protocols describe them, over libzmq, beside
`sentree run --groot`. Ends with 77 (skipped) where python3-zmq or the program's ZeroMQ is missing."""
import json
import os
import re
import shlex
import signal
import struct
import subprocess
import sys
import threading
import time

try:
    import zmq
except ImportError:
    print("SKIPPED: python3-zmq is not installed")
    sys.exit(77)

sentree, source, work = sys.argv[1:4]
os.makedirs(work, exist_ok=True)
os.chdir(work)
context = zmq.Context()
failures = []


def check(what, holds, seen=""):
    if not holds:
        failures.append(what)
        print("FAILED", what, seen)


class Run:
    """A run, or a recording that is played; and where it serves Groot."""

    def __init__(self, *arguments):
        self.log = open("run.log", "w")
        self.child = subprocess.Popen([sentree, *arguments], stdin=subprocess.DEVNULL, stdout=self.log,
                                      stderr=subprocess.PIPE, text=True)
        found, text = None, ""
        for line in self.child.stderr:
            text += line
            found = re.search(r"Groot 2: 127\.0\.0\.1:(\d+); Groot 1: publisher port (\d+), server port (\d+)", line)
            if found:
                break
        if "without ZeroMQ" in text:
            print("SKIPPED: built without ZeroMQ")
            sys.exit(77)
        if not found:
            print("FAILED: it did not begin:", text)
            sys.exit(1)
        threading.Thread(target=self.child.stderr.read, daemon=True).start()
        check("it says that nobody is authenticated", "nobody is authenticated" in text)
        self.groot2, self.publisher, self.server = map(int, found.groups())
        self.request = None

    def ask(self, letter, body=None):
        """The parts of Groot 2's answer; the header's form is checked."""
        if self.request is None:
            self.request = self.socket(zmq.REQ, self.groot2)
        header = struct.pack("<BcI", 2, letter, 0x31E99E04)
        self.request.send_multipart([header] + ([] if body is None else [body]))
        parts = self.request.recv_multipart()
        if parts[0] != b"error":
            check("header of %r" % letter, parts[0][:6] == header and len(parts[0]) == 22, parts)
        return parts

    def socket(self, kind, port):
        socket = context.socket(kind)
        socket.setsockopt(zmq.LINGER, 0)
        socket.setsockopt(zmq.RCVTIMEO, 20000)
        if kind == zmq.SUB:
            socket.setsockopt(zmq.SUBSCRIBE, b"")
        socket.connect("tcp://127.0.0.1:%d" % port)
        return socket

    def end(self, expected=None):
        if expected is None:
            self.child.send_signal(signal.SIGINT)
        code = self.child.wait(60)
        if expected is not None:
            check("exit code %d" % expected, code == expected, code)


class Table:
    """A table of a FlatBuffer, by the number of its field."""

    def __init__(self, data, at):
        self.data, self.at = data, at
        self.vtable = at - struct.unpack_from("<i", data, at)[0]

    def offset(self, field):
        """0: the field has its default."""
        if 4 + 2 * field >= struct.unpack_from("<H", self.data, self.vtable)[0]:
            return 0
        return struct.unpack_from("<H", self.data, self.vtable + 4 + 2 * field)[0]

    def place(self, field):
        assert self.offset(field) != 0
        return self.at + self.offset(field)

    def number(self, field, form):
        return struct.unpack_from(form, self.data, self.place(field))[0] if self.offset(field) else 0

    def follow(self, at):
        return at + struct.unpack_from("<I", self.data, at)[0]

    def text(self, field):
        at = self.follow(self.place(field))
        size = struct.unpack_from("<I", self.data, at)[0]
        return self.data[at + 4:at + 4 + size].decode()

    def places(self, field, width):
        at = self.follow(self.place(field))
        return [at + 4 + width * i for i in range(struct.unpack_from("<I", self.data, at)[0])]

    def tables(self, field):
        return [Table(self.data, self.follow(at)) for at in self.places(field, 4)]


def groot1_tree(data):
    """What Groot 1 requires of the tree; returns its nodes by number: (status, name)."""
    root = Table(data, struct.unpack_from("<I", data, 0)[0])
    nodes = root.tables(1)
    models = {model.text(0): [port.text(0) for port in model.tables(2)] for model in root.tables(2)}
    by_uid, children = {}, {}
    for node in nodes:
        uid = node.number(0, "<H")
        by_uid[uid] = (node.number(2, "<b"), node.text(3), node.text(4))
        children[uid] = [struct.unpack_from("<H", data, at)[0] for at in node.places(1, 2)]
        check("a model of " + node.text(4), node.text(4) in models)
        for port in node.tables(5):
            check("port %s of %s is in the model" % (port.text(0), node.text(4)), port.text(0) in models[node.text(4)])
    order = []

    def walk(uid):
        order.append(uid)
        for child in children[uid]:
            walk(child)

    walk(list(by_uid)[0])
    check("depth-first order", order == list(by_uid), order)
    return by_uid


def update_of(message):
    """Snapshot and transitions of what Groot 1 is pushed."""
    size = struct.unpack_from("<I", message)[0]
    snapshot = [struct.unpack_from("<Hb", message, 4 + at) for at in range(0, size, 3)]
    count = struct.unpack_from("<I", message, 4 + size)[0]
    changes = [struct.unpack_from("<IIHbb", message, 8 + size + 12 * i) for i in range(count)]
    check("the update has no more than it says", len(message) == 8 + size + 12 * count)
    return snapshot, changes


def unpack(data):
    """MessagePack, as far as it is needed."""
    value, rest = unpack_one(data)
    assert rest == b""
    return value


def unpack_one(data):
    head, data = data[0], data[1:]
    if head < 0x80:
        return head, data
    if head >= 0xE0:
        return head - 256, data
    if head < 0x90 or head == 0xDE:
        count = head & 15
        if head == 0xDE:
            count, data = struct.unpack(">H", data[:2])[0], data[2:]
        result = {}
        for _ in range(count):
            key, data = unpack_one(data)
            result[key], data = unpack_one(data)
        return result, data
    if head < 0xA0:
        result = []
        for _ in range(head & 15):
            item, data = unpack_one(data)
            result.append(item)
        return result, data
    if head < 0xC0:
        return data[:head & 31].decode(), data[head & 31:]
    if head == 0xD9:
        return data[1:1 + data[0]].decode(), data[1 + data[0]:]
    if head in (0xC0, 0xC2, 0xC3):
        return {0xC0: None, 0xC2: False, 0xC3: True}[head], data
    form = {0xCA: ">f", 0xCB: ">d", 0xCC: ">B", 0xCD: ">H", 0xCE: ">I", 0xCF: ">Q",
            0xD0: ">b", 0xD1: ">h", 0xD2: ">i", 0xD3: ">q"}[head]
    size = struct.calcsize(form)
    return struct.unpack(form, data[:size])[0], data[size:]


def hook(uid, mode, desired, position=0, once=False):
    return json.dumps({"enabled": True, "uid": uid, "mode": mode, "once": once, "desired_status": desired,
                       "position": position}).encode()


def run(*more):
    return Run("run", source + "/examples/recharge", "--scenario", "experiment1", "--groot=0", *more)


# A tree as BehaviorTree.CPP 3 describes it: what reads ours reads that.
EXAMPLE = """
    10000000 00000a00 10000400 08000c00 0a000000 01000000 08000000 dc000000
    02000000 18000000 68000000 10001c00 04000800 0c001000 14001800 10000000
    01000000 14000000 00000000 14000000 1c000000 28000000 01000000 02000000
    04000000 726f6f74 00000000 08000000 53657175 656e6365 00000000 00000000
    10001c00 04000800 0c001000 14001800 10000000 02000000 14000000 00000000
    10000000 14000000 1c000000 00000000 02000000 676f0000 04000000 476f546f
    00000000 01000000 0c000000 08000c00 04000800 08000000 08000000 10000000
    05000000 77686572 65000000 06000000 7b676f61 6c7d0000 02000000 14000000
    7c000000 00000a00 10000400 08000c00 0a000000 0c000000 01000000 10000000
    04000000 476f546f 00000000 01000000 10000000 0c001400 04000800 0c001000
    0c000000 10000000 00000000 14000000 1c000000 05000000 77686572 65000000
    06000000 73747269 6e670000 00000000 00000a00 10000400 08000c00 0a000000
    0c000000 03000000 14000000 08000000 53657175 656e6365 00000000 00000000
"""
check("an example of others", groot1_tree(bytes.fromhex(EXAMPLE)) == {1: (0, "root", "Sequence"), 2: (0, "go", "GoTo")},
      groot1_tree(bytes.fromhex(EXAMPLE)))

# The same bytes are recorded whether somebody looks or not.
quiet = [sentree, "run", source + "/examples/recharge", "--scenario", "experiment1", "--clock", "virtual"]
subprocess.run(quiet + ["--record", "quiet.mcap"], stdin=subprocess.DEVNULL, capture_output=True, timeout=60)
shown = run("--clock", "virtual", "--factor", "60", "--record", "shown.mcap")

# Groot 1: the tree, then what changes.
pushed = shown.socket(zmq.SUB, shown.publisher)
request = shown.socket(zmq.REQ, shown.server)
request.send(b"")
nodes = groot1_tree(request.recv())
check("the names of the leaves", "GoToKitchen" in [name for _, name, _ in nodes.values()], nodes)
snapshot, changes = update_of(pushed.recv())
check("a snapshot of all nodes", [uid for uid, _ in snapshot] == list(nodes), snapshot)
check("transitions of these nodes", changes and all(uid in nodes for _, _, uid, _, _ in changes), changes)
check("transitions go from one status to another", all(a != b and 0 <= a <= 3 and 0 <= b <= 3 for *_, a, b in changes))

# Groot 2: tree, statuses, blackboard, recording.
xml = shown.ask(b"T")[1].decode()
check("the first tree is the main one", re.match(r'<root BTCPP_format="4">\s*<BehaviorTree ID="[^"]+" _fullpath="">', xml), xml[:200])
uids = sorted(map(int, re.findall(r'_uid="(\d+)"', xml)))
check("nodes numbered from 1", uids == list(range(1, len(nodes) + 1)), uids)
statuses = shown.ask(b"S")[1]
check("a status of each", sorted(struct.unpack_from("<H", statuses, at)[0] for at in range(0, len(statuses), 3)) == uids)
main = re.search(r'<BehaviorTree ID="([^"]+)"', xml).group(1)
boards = unpack(shown.ask(b"B", main.encode() + b";nosuch")[1])
check("the main blackboard and no other", list(boards) == [main], boards)
check("no such blackboard", shown.ask(b"B", b"nosuch")[1] == b"\xc0")
check("a recording begins at a time", abs(int(shown.ask(b"r", b"start")[1]) / 1e6 - time.time()) < 60)
recorded = b""
while not recorded and shown.child.poll() is None:
    recorded = shown.ask(b"t")[1]
check("recorded changes have nine octets", recorded and len(recorded) % 9 == 0)
check("no hooks", shown.ask(b"D")[1] == b"[]")
check("an error for no such hook", shown.ask(b"R", b'{"uid": 1, "position": 0}') == [b"error", b"Node ID not found"])
check("an error for what is no request", shown.ask(b"Q") == [b"error", b"Request not recognized"])
shown.end(1)  # as the scenario has it, a monitor is violated
check("the recording is the same", open("quiet.mcap", "rb").read() == open("shown.mcap", "rb").read())

# Hooks: a forced result and a breakpoint, in the recording as what they are.
steered = run("--clock", "virtual", "--factor", "2", "--record", "steered.mcap")
xml = steered.ask(b"T")[1].decode()


def uid_of(name):
    return int(re.search(r'name="%s"[^>]* _uid="(\d+)"' % name, xml).group(1))


reached = steered.socket(zmq.SUB, steered.groot2 + 1)
while steered.ask(b"S")[1][2] == 0:
    pass  # it has not begun
control = int(re.search(r'_uid="(\d+)"', xml).group(1))
refused = steered.ask(b"I", hook(control, 1, "FAILURE"))
check("only leaves can be given results", refused[0] == b"error" and b"skill" in refused[1], refused)
kitchen, level = uid_of("GoToKitchen"), uid_of("BatteryLevelAbove30")
check("a breakpoint is taken", len(steered.ask(b"I", hook(kitchen, 0, "SKIPPED"))) == 1)
notice = reached.recv_multipart()
check("it is told", notice[0][:2] == b"\x02N" and notice[1] == str(kitchen).encode(), notice)
check("it is listed", json.loads(steered.ask(b"D")[1])[0]["uid"] == kitchen)
before = steered.ask(b"S")[1]
check("the run stands", before == steered.ask(b"S")[1])
unlock = json.dumps({"uid": kitchen, "desired_status": "SKIPPED", "position": 0, "remove_when_done": True}).encode()
check("it is unlocked", len(steered.ask(b"U", unlock)) == 1)
check("and gone", steered.ask(b"D")[1] == b"[]")
steered.ask(b"I", hook(kitchen, 0, "SKIPPED"))
reached.recv_multipart()
check("one that is taken away lets the run go on", len(steered.ask(b"R", b'{"uid": %d, "position": 0}' % kitchen)) == 1)
steered.ask(b"r", b"start")
while not steered.ask(b"t")[1]:
    pass
check("a result is replaced", len(steered.ask(b"I", hook(level, 1, "FAILURE"))) == 1)
notice = reached.recv_multipart()
check("which is told", notice[1] == str(level).encode(), notice)
check("all hooks go", len(steered.ask(b"A")) == 1)
steered.end()
lines = subprocess.run([sentree, "export", "steered.mcap", "--to", "ndjson"], capture_output=True, text=True,
                       timeout=60).stdout.splitlines()
done = [line for line in lines if '"/observations"' in line and "scenario.injection" in line and '"groot"' in line]
check("two breakpoints, their ends, a forced result and its end are recorded", len(done) == 6, done)
check("the forced answer is recorded as one", any('"forced":true' in line and "BatteryLevelAbove30" in line for line in lines))

# A recording is played when Groot comes, and again when it comes once more.
played = Run("studio", "shown.mcap", "--at", "0", "--groot=0", "--factor", "1000")
pushed = played.socket(zmq.SUB, played.publisher)
request = played.socket(zmq.REQ, played.server)
for again in (False, True):
    request.send(b"")
    nodes = groot1_tree(request.recv())
    if again:
        _, changes = update_of(pushed.recv())
        check("it is played again", len(changes) > 0)
    while not any(played.ask(b"S")[1][2::3]):
        pass  # nothing has happened yet
    check("hooks are refused", played.ask(b"I", hook(1, 0, "SKIPPED"))[0] == b"error")
    while not again and pushed.poll(500):
        update_of(pushed.recv())
board = unpack(played.ask(b"B", main.encode())[1])[main]
check("the recorded blackboard is a map", isinstance(board, dict), board)
played.end()

# Watching: a run of ours as the program, recorded; the recording is one like any other.
program = Run("run", source + "/examples/recharge", "--scenario", "experiment1", "--clock", "real", "--factor", "20",
              "--no-record", "--groot=0")
done = subprocess.run([sentree, "watch", "zmq://127.0.0.1:%d" % program.groot2, "--record", "watched.mcap", "--duration",
                       "2 s"], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)
check("it is watched", done.returncode == 0 and "GoToKitchen: RUNNING" in done.stdout, done)
program.end()
lines = subprocess.run([sentree, "export", "watched.mcap", "--to", "ndjson"], capture_output=True, text=True,
                       timeout=60).stdout.splitlines()
check("what was seen is recorded", any("node.status" in line and "GoToKitchen" in line for line in lines), lines[:3])
done = subprocess.run([sentree, "replay", "watched.mcap"], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                      timeout=60)
check("it cannot be replayed, and says so", done.returncode != 0 and "not here" in done.stderr + done.stdout, done)
played = Run("studio", "watched.mcap", "--at", "0", "--groot=0", "--factor", "1000")
check("it opens in the studio", b"GoToKitchen" in played.ask(b"T")[1])
played.end()


class Publisher(threading.Thread):
    """What BehaviorTree.CPP 4.10 answers, of a tree with two instances of a SubTree and nodes that nobody knows."""

    XML = """<root BTCPP_format="4">
    <BehaviorTree ID="M" _fullpath="">
        <RecoveryNode name="root" _uid="1" number_of_retries="6">
            <Sequence name="Sequence" _uid="2">
                <SubTree ID="Go" _fullpath="go1" _uid="3" goal="{dock}"/>
                <SubTree ID="Go" _fullpath="Go::4" _uid="4" goal="1;2;3"/>
            </Sequence>
            <BatteryOk name="BatteryOk" _uid="5" min="0.3" _skipIf="n == 8"/>
        </RecoveryNode>
    </BehaviorTree>
    <BehaviorTree ID="Go" _fullpath="go1"><GoTo name="GoTo" _uid="6" where="{goal}"/></BehaviorTree>
    <BehaviorTree ID="Go" _fullpath="Go::4"><GoTo name="GoTo" _uid="7" where="{goal}"/></BehaviorTree>
    <TreeNodesModel>
        <Control ID="RecoveryNode"><input_port name="number_of_retries" type="int"/></Control>
        <Condition ID="BatteryOk"><input_port name="min" type="double" default="0.200000">least</input_port></Condition>
        <Action ID="GoTo"><input_port name="where" type="Pose2D"/></Action>
        <SubTree ID="SubTree"><input_port name="_autoremap" type="bool" default="false"/></SubTree>
    </TreeNodesModel>
</root>"""

    def __init__(self):
        super().__init__(daemon=True)
        self.socket = context.socket(zmq.REP)
        self.socket.setsockopt(zmq.LINGER, 0)
        self.port = self.socket.bind_to_random_port("tcp://127.0.0.1")
        self.asked = []
        self.looks = 0

    def body(self, letter, body):
        if letter == b"T":
            return self.XML.encode()
        if letter == b"S":
            return b"".join(struct.pack("<HB", uid, code) for uid, code in
                            [(1, 1), (2, 1), (3, 1), (4, 0), (5, 13), (6, 1 if self.looks < 3 else 2),
                             (7, 0 if self.looks < 6 else 3), (99, 1)])
        if letter == b"B":
            check("each blackboard is asked for", body == b"M;go1;Go::4", body)
            return bytes.fromhex("82 a1 4d 82 a1 6e 07 a4 64 6f 63 6b a1 41 a3 67 6f 31 80")
        if letter == b"r":
            return b"1795344874377177"
        if letter == b"t":
            self.looks += 1
            if self.looks == 3:
                return struct.pack("<IHHB", 452916, 0, 6, 2) + struct.pack("<IHHB", 452917, 0, 98, 2)
            return b"" if self.looks != 4 else b"nonsense"
        return None

    def run(self):
        tree = 1
        while True:
            header, *rest = self.socket.recv_multipart()
            letter = header[1:2]
            self.asked.append(letter)
            if self.looks > 40:
                tree = 2
            body = self.body(letter, rest[0] if rest else b"")
            if body == b"error":
                self.socket.send_multipart([b"error", b"Request not recognized"])
                continue
            self.socket.send_multipart([header + bytes([tree]) * 16] + ([] if body is None else [body]))


class OldPublisher(Publisher):
    """What BehaviorTree.CPP 4.1 and 4.2 answer: it records nothing, so what a node was is in its status alone."""

    # By the look: the main tree ends, a leaf is halted and runs again, one ends between two looks, and one did so before.
    WENT = [[(1, 1), (2, 1), (6, 1), (5, 0), (7, 12)], [(1, 1), (2, 1), (6, 11), (5, 13), (7, 12)], [(1, 1), (2, 1), (6, 1), (5, 13), (7, 12)],
            [(1, 12), (2, 12), (6, 12), (5, 13), (7, 12)]]

    def body(self, letter, body):
        if letter in (b"r", b"t"):
            return b"error"
        if letter == b"S":
            self.looks += 1
            return b"".join(struct.pack("<HB", uid, code) for uid, code in self.WENT[min((self.looks - 1) // 2, 3)])
        return super().body(letter, body)


program = OldPublisher()
program.start()
done = subprocess.run([sentree, "watch", "127.0.0.1:%d" % program.port, "--record", "old.mcap", "--duration", "3 s"],
                      stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60, cwd=work)
told = re.findall(r"^\s*[\d.:]+\s*s?\s+(\S.*)$", done.stdout, re.M)
check("what is idle already is told as what it was", [line for line in told if line.startswith("BatteryOk")] == ["BatteryOk: FAILURE"], done)
check("what was halted runs again", [line for line in told if line.startswith("go1.GoTo")]
      == ["go1.GoTo: RUNNING", "go1.GoTo: halted", "go1.GoTo: RUNNING", "go1.GoTo: SUCCESS"], done)
check("the mission's end is told", [line for line in told if line.startswith("mission")] == ["mission: RUNNING", "mission: SUCCESS"], done)
check("what was before is not told", "Go::4" not in done.stdout, done)
lines = subprocess.run([sentree, "export", "old.mcap", "--to", "ndjson"], capture_output=True, text=True, timeout=60).stdout.splitlines()
check("it is recorded so", sum("node.status" in line and "go1.GoTo" in line and '"to":"SUCCESS"' in line for line in lines) == 1, lines)

program = Publisher()
program.start()
done = subprocess.run([sentree, "watch", "127.0.0.1:%d" % program.port, "--record", "foreign.mcap", "--duration", "4 s"],
                      stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60, cwd=work)
check("a tree of others is watched", done.returncode == 0, done)
check("what cannot be read is told", "the recorded changes are cut off" in done.stderr, done.stderr)
check("another tree is another recording", "another tree" in done.stderr, done.stderr)
lines = subprocess.run([sentree, "export", "foreign.mcap", "--to", "ndjson"], capture_output=True, text=True,
                       timeout=60).stdout.splitlines()
went = [line for line in lines if "node.status" in line and "go1.GoTo" in line]
check("its statuses and changes", len(went) == 2 and '"SUCCESS"' in went[1], went)
lost = [line for line in lines if "node.status" in line and "Go::4.GoTo" in line]
check("what somebody else was told is found by comparing", len(lost) == 1 and '"FAILURE"' in lost[0], lost)
check("its blackboard", any('"dock":"A"' in line and '"n":7' in line for line in lines), lines)
info = subprocess.run([sentree, "info", "foreign.mcap"], capture_output=True, text=True, timeout=60)
check("it is a recording", info.returncode == 0, info)
nobody = subprocess.run([sentree, "watch", "127.0.0.1:9", "--no-record"], stdin=subprocess.DEVNULL, capture_output=True,
                        text=True, timeout=60)
check("nobody there", nobody.returncode == 4 and "nobody answers" in nobody.stderr, nobody)

# What the guides say can be done so; only ports and addresses are others.
program = Run("run", source + "/examples/recharge", "--scenario", "experiment1", "--clock", "real", "--no-record",
              "--groot=0")
robot = "zmq://127.0.0.1:%d" % program.groot2
for name, least in (("use-groot.md", 4), ("watch-behaviortree-cpp.md", 3)):
    page = open(source + "/docs/how-to/" + name).read()
    commands = [line.split("#")[0] for line in re.findall(r"^sentree .*", page, re.M)]
    check("the guide has commands", len(commands) >= least, commands)
    for command in commands:
        words = [re.sub(r"^--groot.*", "--groot=0", word) for word in shlex.split(command)[1:]]
        words = [re.sub(r"^zmq://.*", robot, word).replace("--studio", "--studio=0") for word in words]
        words = [word.replace("90 s", "1 s").replace("RUN.mcap", "shown.mcap").replace("examples/", source + "/examples/")
                 for word in words if word != "--open"]
        if words[0] == "watch" and "--duration" not in words:
            words += ["--duration", "1 s"]
        if "--groot=0" not in words:
            done = subprocess.run([sentree, *words], stdin=subprocess.DEVNULL, capture_output=True, timeout=60)
            check("the guide's " + command, done.returncode == 0, done.stderr)
            continue
        guided = Run(*words, *(["--no-record"] if words[0] == "run" else ["--at", "0"]))
        check("the guide's " + command, b"<root" in guided.ask(b"T")[1])
        guided.end()
program.end()

print("%d failures" % len(failures))
sys.exit(1 if failures else 0)
