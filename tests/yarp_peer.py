#!/usr/bin/env python3
"""yarp_peer.py SENTREE SOURCE_DIR WORK_DIR: ports, callers and tools of YARP as their octets were seen, over sockets of
the standard library alone, beside `sentree sim --yarp`, `sentree skill` and `sentree run --yarp-server`."""
import atexit
import json
import os
import re
import shlex
import shutil
import signal
import socket
import struct
import subprocess
import sys
import threading
import time

from mission_elsewhere import check_verdicts

sentree, source, work = sys.argv[1:4]
shutil.rmtree(work, ignore_errors=True)
os.makedirs(work)
os.chdir(work)
failures = []
PATIENCE = 60


def check(what, holds, seen=""):
    if not holds:
        failures.append(what)
        print("FAILED", what, seen)


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


NAMES = ("127.0.0.1", free_port())
environment = dict(os.environ, SENTREE_YARP_SERVER="%s:%d" % NAMES)


# ---- octets

def word(text):
    if len(text) <= 4:
        return struct.pack("<i4s", 9, text.encode())
    return struct.pack("<ii", 4, len(text)) + text.encode()


def i32(n):
    return struct.pack("<ii", 1, n)


def text(s):
    return struct.pack("<ii", 4, len(s.encode())) + s.encode()


def real(x):
    return struct.pack("<id", 10, x)


def flat(*items):
    return struct.pack("<ii", 256, len(items)) + b"".join(items)


def call_of(name, *arguments):
    return flat(*[word(part) for part in name.split("_")], *arguments)


class Closed(Exception):
    pass


class Wire:
    def __init__(self, sock):
        self.sock = sock
        self.sock.settimeout(PATIENCE)
        self.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def take(self, n):
        out = b""
        while len(out) < n:
            got = self.sock.recv(n - len(out))
            if not got:
                raise Closed()
            out += got
        return out

    def int(self):
        return struct.unpack("<i", self.take(4))[0]

    def line(self):
        out = b""
        while not out.endswith(b"\n"):
            out += self.take(1)
        return out.decode().rstrip("\r\n")

    def value(self, tag):
        if tag & 256:
            return self.items(tag)
        if tag in (1, 17, 32, 64):
            return struct.unpack("<" + {1: "i", 17: "q", 32: "b", 64: "h"}[tag],
                                 self.take({1: 4, 17: 8, 32: 1, 64: 2}[tag]))[0]
        if tag == 9:
            return "[" + self.take(4).rstrip(b"\0").decode() + "]"
        if tag == 10:
            return struct.unpack("<d", self.take(8))[0]
        if tag == 4:
            return self.take(self.int()).decode()
        if tag == 12:
            return self.take(self.int())
        raise ValueError("tag %d" % tag)

    def items(self, tag=None):
        if tag is None:
            tag = self.int()
        count = self.int()
        own = tag & ~256
        return [self.value(own if own else self.int()) for _ in range(count)]


ACK = b"YA\0\0\0\0RP"


def framed(payload, key=b"d"):
    return (b"YA\x0a\0\0\0RP" + b"\x02\x01" + b"\xff" * 8 + struct.pack("<iii", 8, len(payload), 0) +
            struct.pack("<i", 0) + b"~" + key + b"\0\1" + payload)


class Sender(Wire):
    """An output connection: the carrier tcp."""

    def __init__(self, at, name="peer"):
        super().__init__(socket.create_connection(at, PATIENCE))
        self.sock.sendall(b"YA\xe4\x1e\0\0RP" + struct.pack("<i", len(name) + 1) + name.encode() + b"\0")
        mark = self.take(8)
        check("a port answers the greeting with its number", mark == b"YA" + struct.pack("<i", at[1]) + b"RP", mark)

    def ask(self, payload):
        self.sock.sendall(framed(payload))
        reply = self.items()
        check("a reply is acknowledged on tcp", self.take(8) == ACK)
        return reply

    def tell(self, payload):
        self.sock.sendall(framed(payload, b"D"))
        check("data are acknowledged on tcp", self.take(8) == ACK)


def names(*words):
    w = Wire(socket.create_connection(NAMES, PATIENCE))
    w.sock.sendall(("NAME_SERVER " + " ".join(words) + "\r\n").encode())
    out = []
    while True:
        line = w.line()
        if line == "*** end of message":
            return out
        out.append(line)
        if words[0] == "announce":
            return out


def where(name):
    lines = names("query", name)
    if not lines:
        return None
    words = lines[0].split()
    return words[4], int(words[6])


class Tool(Wire):
    """yarp ping, exists, connect: the carrier text_ack."""

    def __init__(self, at):
        super().__init__(socket.create_connection(at, PATIENCE))
        self.sock.sendall(b"CONNACK admin\r\n")
        check("a tool is welcome", self.line() == "Welcome admin")

    def say(self, *lines):
        self.sock.sendall("".join(line + "\r\n" for line in lines).encode())
        out = []
        while True:
            line = self.line()
            if line == "<ACK>":
                return "\n".join(out)
            out.append(line)


class Port:
    """A port of a program: answers calls by `answer`, sends data to whom it is told."""

    def __init__(self, name, answer=None):
        self.name, self.answer, self.outputs, self.wired, self.heard = name, answer, {}, threading.Event(), []
        self.told = threading.Event()
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.at = self.listener.getsockname()
        names("register", name, "tcp", self.at[0], str(self.at[1]))
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            try:
                sock, _ = self.listener.accept()
            except OSError:
                return
            threading.Thread(target=self.attend, args=(Wire(sock),), daemon=True).start()

    def attend(self, wire):
        try:
            head = wire.take(8)
            if head == b"CONNACK ":
                return self.talk(wire)
            wire.take(wire.int())
            wire.sock.sendall(b"YA" + struct.pack("<i", self.at[1]) + b"RP")
            while True:
                assert wire.take(8) == b"YA\x0a\0\0\0RP"
                blocks, replies = wire.take(2)
                wire.take(8)
                for _ in range(blocks + replies):
                    wire.int()
                command = wire.take(8)
                request = wire.items()
                if command[5:6] == b"D":
                    self.heard.append(request)
                    self.told.set()
                else:
                    reply = self.answer(request)
                    if reply is None:
                        return wire.sock.close()
                    wire.sock.sendall(reply)
                wire.sock.sendall(ACK)
        except (Closed, OSError):
            pass

    def talk(self, wire):
        wire.sock.sendall(("Welcome " + wire.line() + "\r\n").encode())
        while True:
            if wire.line() != "a":
                return wire.sock.sendall(b"<ACK>\r\n")
            asked = wire.line()
            out = ""
            other = re.search(r'"([^"]*)"', asked)
            if asked.startswith("[add]"):
                name = other.group(1).split(":/")[1]
                self.outputs[name] = Sender(where(name), self.name)
                out = '0 "Added connection"'
            elif asked.startswith("[list] [out]") and other and other.group(1) in self.outputs:
                out = '(from "%s") (to "%s") (carrier tcp)' % (self.name, other.group(1))
            wire.sock.sendall((out + "\r\n<ACK>\r\n").encode())
            if asked.startswith("[add]"):
                self.wired.set()

    def write(self, payload):
        for output in self.outputs.values():
            output.tell(payload)


# ---- programs

class Program:
    def __init__(self, *arguments, until="listening on"):
        self.said = ""
        self.found = threading.Event()
        self.until = until
        self.child = subprocess.Popen([sentree, *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                      stderr=subprocess.STDOUT, text=True, env=environment)
        atexit.register(self.child.kill)
        threading.Thread(target=self.read, daemon=True).start()
        if not self.found.wait(PATIENCE) or self.until not in self.said:
            print("FAILED: it did not begin:", arguments, self.said)
            self.end()
            sys.exit(1)

    def read(self):
        for line in self.child.stdout:
            self.said += line
            if self.until in self.said:
                self.found.set()
        self.found.set()

    def end(self):
        self.child.send_signal(signal.SIGINT)
        try:
            self.child.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.child.kill()
            failures.append("a program did not end")


def run(*arguments):
    done = subprocess.run([sentree, *arguments], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                          env=environment, timeout=5 * PATIENCE)
    return done.returncode, done.stdout, done.stderr


def completes(what, word, *line):
    """A line is completed in time, or without words: on a busy machine one asks again."""
    until, out, err = time.monotonic() + PATIENCE, "", ""
    while word not in out and time.monotonic() < until:
        _, out, err = run("__complete", *line)
    check(what, word in out, out + err)


def simulated_robot():
    sim = Program("sim", "--world", source + "/examples/recharge/world/world.yaml", "--yarp", "--headless")
    check("it says that nobody is authenticated", "no authentication" in sim.said, sim.said)
    listed = " ".join(names("list"))
    for port in ("/battery/rpc:i", "/navigation/rpc:i", "/simulation/rpc:i", "/root"):
        check("yarp name list shows " + port, "name %s ip 127.0.0.1 port" % port in listed, listed)
    at = where("/battery/rpc:i")
    tool = Tool(at)
    check("yarp ping", tool.say("*").startswith("This is /battery/rpc:i at tcp://127.0.0.1:%d/\n" % at[1]))
    check("yarp exists", tool.say("a", "[ver]") == "[ver] 1 2 3")
    check("yarp where", Tool(NAMES).say("a", "[ver]") == "[ver] 1 2 3")

    battery = Sender(at)
    check("a charge", 0 <= battery.ask(call_of("getBatteryCharge"))[0] <= 100)
    check("a bool", battery.ask(call_of("isCharging")) == ["[fail]"])
    state = battery.ask(call_of("getBatteryState"))
    check("a struct lies flat", len(state) == 9 and isinstance(state[1], str), state)
    check("an unknown method", battery.ask(call_of("noSuchThing")) == ["[fail]"])
    check("help", battery.ask(call_of("help"))[1][0] == "*** Available commands:")
    navigation = Sender(where("/navigation/rpc:i"))
    check("a goal", navigation.ask(call_of("gotoTargetByLocationName", text("kitchen")))[0] == 0)
    try:
        navigation.sock.sendall(framed(call_of("gotoTargetByLocationName")))
        check("nothing that a generated client hangs on", False, navigation.take(1))
    except (Closed, ConnectionError):
        pass

    code, out, err = run("call", "yarp:/battery/rpc:i", "getBatteryCharge", "--interface", "robot.thrift/Battery")
    check("sentree call yarp:", code == 0 and 0 <= float(out) <= 100, out + err)
    code, out, err = run("call", "yarp:/simulation/rpc:i", "setBatteryCharge", "percent=12", "--interface",
                         "robot.thrift/Simulation")
    check("an enum", code == 0 and out == '"OK"\n', out + err)
    check("it did so", 11 < battery.ask(call_of("getBatteryCharge"))[0] <= 12)
    state = run("echo", "yarp:/telemetry/battery:o", "-n", "1")[1]
    check("the battery is published", state.startswith("battery ") and len(state.split()) == 10, state)
    for topic in ("position", "odometry", "navigation", "scan"):
        code, out, err = run("echo", "yarp:/telemetry/%s:o" % topic, "-n", "1")
        # Up to four letters are a word of YARP's own kind, which is shown in brackets.
        check("so is " + topic, code == 0 and out.startswith((topic + " ", "[" + topic + "] ")), out[:200] + err)
    of_sim = ("--run", str(sim.child.pid))
    code, out, err = run("services", *of_sim, "--json")
    where_it_is = {each["name"]: each["at"] for each in json.loads(out)}
    check("sentree services of a simulator", where_it_is["battery"] == "yarp:/battery/rpc:i", out + err)
    code, out, err = run("ping", *of_sim)
    check("sentree ping of a simulator", code == 0 and "yarp:/battery/rpc:i" in out and "✗" not in out, out + err)
    echo = subprocess.Popen([sentree, "echo", *of_sim, "battery.*", "-n", "2"], stdin=subprocess.DEVNULL,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    # It hears what is called from when it asks on.
    while echo.poll() is None:
        battery.ask(call_of("getBatteryCharge"))
    out, err = echo.communicate(timeout=PATIENCE)
    check("sentree echo of a simulator", echo.returncode == 0 and "battery.getBatteryCharge.re" in out, out + err)
    check("it goes on", 0 <= battery.ask(call_of("getBatteryCharge"))[0] <= 100)
    second = Program("sim", "--world", source + "/examples/recharge/world/world.yaml", "--yarp", "--at", "yarp:/r1/",
                     "--headless",
                     until="listening on yarp:/r1/")
    check("it says so where another name server is, too", "YARP has no authentication" in second.said, second.said)
    code, out, err = run("services", "--run", str(second.child.pid), "--json")
    where_it_is = {each["name"]: each["at"] for each in json.loads(out)}
    check("below another name", where_it_is["battery"] == "yarp:/r1/battery/rpc:i", out + err)
    check("and nowhere else", where("/battery/rpc:i") == at)
    second.end()

    code, out, err = run("call", "yarp:/nobody", "getBatteryCharge", "--interface", "robot.thrift/Battery")
    check("a port that is not there", code == 4 and "knows no such port" in err, err)
    code, out, err = run("ping", "yarp:/battery/rpc:i")
    check("sentree ping yarp:", code == 0 and "yarp:/battery/rpc:i" in out, out + err)
    code, out, err = run("ping", "yarp:/batery/rpc:i")
    check("sentree ping of a name that nobody has", code != 0 and 'did you mean "/battery/rpc:i"?' in out + err
          and "tried again" not in out + err and (out + err).count("yarp:/batery/rpc:i") == 2, out + err)
    code, out, err = run("services", "--on", "yarp:", "--json")
    check("sentree services --on yarp:", code == 0 and "/battery/rpc:i" in [p["name"] for p in json.loads(out)], out + err)
    guide = open(source + "/docs/how-to/join-a-yarp-network.md").read()
    told = re.findall(r"^\$ sentree ((?:services|ping|call) .*?)\s*(?:#.*)?$", guide, re.M)
    check("the guide has commands", len(told) == 3, told)
    for command in told:
        code, out, err = run(*shlex.split(command))
        check("the guide says: sentree " + command, code == 0, out + err)
    code, out, err = run("doctor")
    check("sentree doctor", "yarp:" in out and "name server %s:%d answers" % NAMES in out, out)
    completes("completion", "yarp:/battery/rpc:i", "call", "yarp:")
    for more in ((), ("--interface", "robot.thrift/Battery")):
        completes("completion of the methods at an address", "getBatteryState", "call", *more, "yarp:/battery/rpc:i", "")
    code, out, err = run("call", "yarp:/mapserver/rpc:i", "getMap", "map_id=", "--interface", "robot.thrift/MapServer")
    check("an empty text, which means the map that is there", code == 0 and '"map_id":"house"' in out, out[:300] + err)
    return sim


def components_of_others():
    port = Port("/py/battery", lambda asked: flat(real(42.5)) if asked[0] == "getBatteryCharge" else None)
    code, out, err = run("call", "yarp:/py/battery", "getBatteryCharge", "--interface", "robot.thrift/Battery")
    check("a component of others", code == 0 and out == "42.5\n", out + err)
    code, out, err = run("call", "yarp:/py/battery?carrier=tcp&server=%s:%d" % NAMES, "getBatteryCharge", "--interface",
                         "robot.thrift/Battery")
    check("with the name server in the address", code == 0 and out == "42.5\n", out + err)
    code, out, err = run("call", "yarp://127.0.0.1:%d/py/battery" % port.at[1], "getBatteryCharge", "--interface",
                         "robot.thrift/Battery")
    check("with its number in the address", code == 0 and out == "42.5\n", out + err)
    code, out, err = run("call", "yarp:/py/battery", "isCharging", "--interface", "robot.thrift/Battery")
    check("one that closes before its reply", code == 4 and err.startswith("unreachable"), err)

    stream = Port("/py/level:o")
    echo = subprocess.Popen([sentree, "echo", "yarp:/py/level:o", "-n", "2"], stdin=subprocess.DEVNULL,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    check("a reader asks to be connected", stream.wired.wait(PATIENCE))
    stream.write(flat(text("level"), real(40.5)))
    stream.write(flat(text("two words"), i32(7)))
    out, err = echo.communicate(timeout=PATIENCE)
    check("sentree echo yarp:", out == 'level 40.5\n"two words" 7\n', out + err)

    # A port whose name says nothing, and something between that has no known type.
    stream = Port("/py/writer")
    echo = subprocess.Popen([sentree, "echo", "yarp:/py/writer", "-n", "2"], stdin=subprocess.DEVNULL,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    check("a reader of any name asks to be connected", stream.wired.wait(PATIENCE))
    for payload in (flat(i32(1)), struct.pack("<iiii", 256, 1, 255, 1), flat(i32(2))):
        stream.write(payload)
    out, err = echo.communicate(timeout=PATIENCE)
    check("what cannot be read ends nothing", out == "1\n2\n" and "unknown tag 255" in err, out + err)


def skill_ticked_by_others():
    # Nobody tells it the values of its ports: they are those of its leaf in the tree.
    shutil.copytree(source + "/examples/recharge", "ticked")
    skill = Program("skill", "ticked", "BatteryLevelAbove30", "--listen",
                    "yarp:/BatteryLevelAbove30/tick:i", "--at", "battery=yarp:/battery/rpc:i")
    tree = Sender(where("/BatteryLevelAbove30/tick:i"), "/bt/tick:o")
    Sender(where("/simulation/rpc:i")).ask(call_of("setBatteryCharge", real(80)))
    IDLE, RUNNING, SUCCESS, FAILURE = range(4)
    check("a skill is idle at first", tree.ask(call_of("request_ack")) == [IDLE])
    for expected, percent in ((SUCCESS, 80), (FAILURE, 12)):
        Sender(where("/simulation/rpc:i")).ask(call_of("setBatteryCharge", real(percent)))
        check("it is started", tree.ask(call_of("send_start")) == [])
        told = tree.ask(call_of("request_ack"))
        while told == [RUNNING]:
            told = tree.ask(call_of("request_ack"))
        check("its end is told", told == [expected], told)
        check("once", tree.ask(call_of("request_ack")) == [IDLE])
    check("a tick starts it, too", tree.ask(call_of("request_tick")) == [FAILURE])
    check("it is halted", tree.ask(call_of("send_stop")) == [])
    skill.end()


def topics():
    """What a port of others sends is a topic of the mission, and what the mission publishes goes to one."""
    shutil.copytree(source + "/examples/topics", "topics")
    with open("topics/scenarios/yarp.yaml", "w") as out:
        out.write("""description: a battery elsewhere drains
clock: real
override:
  services:
    battery: {at: "yarp:/py/battery/state:o"}
    notices: {at: "yarp:/py/ears:i"}
timeline:
  - {at: 1 s, call: notices.said, args: {text: hello}}
duration: 1 min
expect: {mission: SUCCESS}
""")
    mission = Program("run", "topics", "--scenario", "yarp", "--yarp-server", "--no-record", until="name server of YARP")
    ears = Port("/py/ears:i")
    battery = Port("/py/battery/state:o")
    check("the mission asks to be connected", battery.wired.wait(PATIENCE))
    check("what is published there comes to a port of others", ears.told.wait(PATIENCE))
    check("as it was said", ears.heard[0] == ["hello"], ears.heard)
    for percentage in (80, 50, 12.5):
        battery.write(flat(real(percentage), word("fail")))
    check("it hears what it waits for", mission.child.wait(PATIENCE) == 0, mission.said)


def imported():
    """A repository of YARP becomes a project whose services are at the ports that its charts name."""
    run("import", source + "/src/import/testdata/robot", "-o", "imported")
    code, out, err = run("check", "imported")
    check("sentree check takes what was imported", code != 3 and "0 errors" in out and "yarp:/CellsComponent" in open("imported/sentree.yaml").read(),
          (code, out, err))


if __name__ == "__main__":
    imported()
    robot = simulated_robot()
    components_of_others()
    skill_ticked_by_others()
    robot.end()
    check("the name server went with it", subprocess.run(
        [sentree, "services", "--on", "yarp:"], env=environment, capture_output=True).returncode == 4)
    topics()
    check_verdicts(run, check, source, "yarp:/robot/", "yarp:/GoTo/tick:i", "yarp:/BatteryLevelAbove30/tick:i",
                   "yarp:/robot/battery/rpc:i", ["--yarp-server"])
    sys.exit(1 if failures else 0)
