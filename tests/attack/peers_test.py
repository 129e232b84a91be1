#!/usr/bin/env python3
"""peers_test.py SENTREE SOURCE WORK [--seed N] [--rounds N]: peers that misbehave in every way, against each listener and each client.

Half frames, wrong ids, floods, silence, an octet now and then, huge lengths, resets, garbage. A listener goes on and answers an honest peer
afterwards; a run whose component lies goes on or ends with an error that is told; none takes more memory than its bounds say."""
import argparse
import base64
import json
import os
import random
import re
import resource
import shutil
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

arguments = argparse.ArgumentParser()
arguments.add_argument("sentree", type=Path)
arguments.add_argument("source", type=Path)
arguments.add_argument("work", type=Path)
arguments.add_argument("--seed", type=int, default=1)
arguments.add_argument("--rounds", type=int, default=1)
arguments.add_argument("--only", choices=("component", "skill", "monitor", "studio", "yarp", "clients"))
arguments.add_argument("--sanitized", action="store_true")
options = arguments.parse_args()
sentree, source, work = options.sentree.resolve(), options.source.resolve(), options.work.resolve()
kPatience_s = 120
kResident_kb = (400 << 10) * (5 if options.sanitized else 1)
CRASH = re.compile(r"terminate called|bad_alloc|what\(\):|Assertion|AddressSanitizer|ThreadSanitizer|runtime error:")
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
os.chdir(work)
environment = dict(os.environ, XDG_RUNTIME_DIR=str(work), TMPDIR=str(work), SENTREE_RUNS=str(work / "runs"), ASAN_OPTIONS="detect_leaks=0")
failures = []
count = {"peers": 0}
chance = random.Random(options.seed)


def check(what, holds, seen=""):
    if not holds:
        failures.append(what)
        print(f"FAILED {what} {str(seen)[-1500:]}", flush=True)


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


# ---- what is sent

def thrift_call(method, sequence=1, kind=1, name_size=None, body=b"\0"):
    name = method.encode()
    return struct.pack(">I", 0x80010000 | kind) + struct.pack(">i", len(name) if name_size is None else name_size) + name + struct.pack(">i", sequence) + body


def framed(message, size=None):
    return struct.pack(">i", len(message) if size is None else size) + message


CALL = thrift_call("getBatteryState")
HTTP = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
KEY = base64.b64encode(bytes(16)).decode()


def socket_of_studio(port, path="/api/ws", more=""):
    return (f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nOrigin: http://127.0.0.1:{port}\r\n"
            f"Sec-WebSocket-Key: {KEY}\r\nSec-WebSocket-Version: 13\r\n{more}\r\n").encode()


def web_frame(text, opcode=1, size=None, fin=True, masked=True):
    data = text if isinstance(text, bytes) else text.encode()
    n = len(data) if size is None else size
    head = bytes([(0x80 if fin else 0) | opcode])
    bit = 0x80 if masked else 0
    head += bytes([bit | n]) if n < 126 else bytes([bit | 126]) + struct.pack(">H", n) if n < 1 << 16 else bytes([bit | 127]) + struct.pack(">Q", n)
    return head + (bytes(4) if masked else b"") + data


def payloads(port):
    """What is said to any listener, whatever it speaks: nobody knows what comes."""
    yield "nothing", b""
    yield "zeros", bytes(100_000)
    yield "ones", b"\xff" * 100_000
    yield "noise", chance.randbytes(5000)
    for name, message in (("plain", CALL), ("framed", framed(CALL))):
        yield f"thrift {name}: half", message[:len(message) // 2]
        yield f"thrift {name}: unknown method", message.replace(b"getBatteryState", b"getBatteryStatf")
        yield f"thrift {name}: flood", message * 3000
        yield f"thrift {name}: slips", bytes(b if chance.random() > 0.1 else chance.randrange(256) for b in message)
    yield "thrift: a name of two gigabytes", thrift_call("x", name_size=0x7FFFFFFF)
    yield "thrift: a negative name", thrift_call("x", name_size=-1)
    yield "thrift: a frame of two gigabytes", framed(CALL, 0x7FFFFFFF)
    yield "thrift: a negative frame", framed(CALL, -1)
    yield "thrift: a frame longer than what is in it", framed(CALL, len(CALL) + 1)
    yield "thrift: a reply that nobody asked for", framed(thrift_call("getBatteryState", 7, 2)) * 100
    yield "thrift: structs in structs", framed(thrift_call("getBatteryState", body=b"\x0c\0\x01" * 50_000))
    yield "thrift: a list of 2^31 bools", framed(thrift_call("getBatteryState", body=b"\x0f\0\x01\x02\x7f\xff\xff\xff"))
    yield "thrift: a map of 2^31", framed(thrift_call("getBatteryState", body=b"\x0d\0\x01\x0b\x0b\x7f\xff\xff\xff"))
    yield "thrift: a text of 2^31", framed(thrift_call("getBatteryState", body=b"\x0b\0\x01\x7f\xff\xff\xff"))
    yield "thrift compact: lengths", framed(b"\x82\x21\x01" + b"\xff" * 5000)
    yield "http", HTTP
    yield "http: half", HTTP[:-2]
    yield "http: a long head", b"GET / HTTP/1.1\r\n" + b"A: " + b"x" * 2_000_000
    yield "http: many fields", b"GET / HTTP/1.1\r\n" + b"A: b\r\n" * 200_000
    yield "http: a length", b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 99999999999999999999\r\n\r\nx"
    yield "http: two lengths", b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 5\r\nContent-Length: 9\r\n\r\nxxxxx"
    yield "http: chunks", b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\nx"
    yield "http: pipelined", HTTP * 2000
    yield "http: paths", b"".join(b"GET " + p + b" HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" for p in (b"/../../etc/passwd", b"/%2e%2e/%2e%2e/etc/passwd", b"/assets/../../x", b"/%00", b"*", b"//x", b"http://x/", b"/api/ws"))
    upgrade = socket_of_studio(port)
    yield "socket: no words", upgrade
    yield "socket: a frame of 2^63", upgrade + web_frame(b"x", size=1 << 62)
    yield "socket: a control frame that is long", upgrade + web_frame(b"x" * 5000, opcode=9)
    yield "socket: without mask", upgrade + web_frame("{}", masked=False)
    yield "socket: parts without end", upgrade + web_frame("{", fin=False) + web_frame(" ", opcode=0, fin=False) * 30_000
    yield "socket: an unknown opcode", upgrade + web_frame("{}", opcode=7)
    yield "socket: not UTF-8", upgrade + web_frame(b"\xff\xfe{}")
    yield "socket: brackets", upgrade + web_frame("[" * 60_000)
    for value in ("{}", "[]", "null", '{"op":1}', '{"op":"hello","token":[]}', '{"op":"seek","id":1,"time":1e999}', '{"op":"seek","id":1,"time":-9223372036854775808}',
                  '{"op":"messages","id":1,"limit":-1}', '{"op":"messages","id":1,"before":18446744073709551615,"limit":500,"filter":{"name":"' + "*a" * 5000 + '"}}',
                  '{"op":"lanes","id":1,"from":0,"to":9223372036854775807,"width":4000}', '{"op":"lanes","id":1,"from":5,"to":-5,"width":-4000}', '{"op":"lanes","id":1,"width":0}',
                  '{"op":"layout","id":1,"collapsed":["' + "x" * 50_000 + '"]}', '{"op":"fold_chart","id":1,"chart":"nobody","closed":[1,2]}', '{"op":"find","id":1,"after":1,"before":1,"filter":[]}',
                  '{"op":"step","id":1}', '{"op":"intervene","id":1,"call":"battery.x","args":[]}', '{"op":"intervene","id":1,"delay":{"by":-1},"clear":1}', '{"op":"speed","id":1,"factor":-1}', '{"op":"speed","id":1,"factor":1e308}',
                  '{"op":"save","id":1,"path":"../../x"}', '{"op":"open","id":1,"file":"/etc/passwd"}', '{"op":"\\u0000","id":{}}'):
        yield f"socket: {value[:60]}", upgrade + web_frame(value) * 3
    yield "socket: a flood of requests", upgrade + web_frame('{"op":"messages","id":1,"limit":500}') * 3000
    upgrade = socket_of_studio(port, "/", "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n")
    everything = '{"op":"subscribe","subscriptions":[' + ",".join(f'{{"id":{i},"channelId":{65536 + i}}}' for i in range(40)) + "]}"
    yield "foxglove: all topics, and nothing is read", upgrade + web_frame(everything)
    yield "foxglove: all topics again and again", upgrade + web_frame(everything) * 2000
    yield "foxglove: on and off", upgrade + (web_frame(everything) + web_frame(json.dumps({"op": "unsubscribe", "subscriptionIds": list(range(40))}))) * 500
    yield "foxglove: octets", upgrade + web_frame(b"\x01\0\0\0\0{}", opcode=2)
    for value in ('{"op":"subscribe","subscriptions":{}}', '{"op":"subscribe","subscriptions":[[],1,null,{"id":1e300,"channelId":-1}]}', '{"op":"unsubscribe","subscriptionIds":[{}]}',
                  '{"op":"advertise","channels":[{"id":1,"topic":"/x"}]}', '{"op":"subscribe","subscriptions":[' + "{}," * 15_000 + "{}]}"):
        yield f"foxglove: {value[:60]}", upgrade + web_frame(value) * 30
    yield "yarp: text", b"CONNECT foo\r\n"
    yield "yarp: a name of a gigabyte", bytes.fromhex("5941e41e00005250") + struct.pack("<I", 1 << 30)
    yield "yarp: text mode", b"YARP\x64\x1e\x00\x00" + b"d\r\n" * 2000
    yield "yarp: lists in lists", bytes.fromhex("5941641e00005250") + struct.pack("<ii", 256, 1) * 20_000
    yield "yarp: names", b"NAME_SERVER register /x tcp 127.0.0.1 99999999\r\n" * 2000 + b"NAME_SERVER list\r\n"
    yield "zmtp: greeting", b"\xff" + bytes(8) + b"\x7f\x03\x00NULL" + bytes(48)
    yield "zmtp: a frame of 2^63", b"\xff" + bytes(8) + b"\x7f\x03\x00NULL" + bytes(48) + b"\x02\x7f" + b"\xff" * 7
    yield "zmtp: a flood of small frames", b"\xff" + bytes(8) + b"\x7f\x03\x00NULL" + bytes(48) + b"\x04\x26\x05READY" + b"\x00\x01x" * 20_000
    yield "tls", bytes.fromhex("1603010200010001fc0303") + bytes(500)


def talk(address, octets, manner):
    """One peer. It never waits for long: what the listener does with it is the listener's affair."""
    count["peers"] += 1
    family = socket.AF_UNIX if isinstance(address, str) else socket.AF_INET
    with socket.socket(family) as s:
        s.settimeout(1)
        try:
            s.connect(address)
            if manner == "slow":
                for i in range(0, min(len(octets), 40)):
                    s.send(octets[i:i + 1])
            elif manner == "deaf":  # takes no answer
                s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)
                s.sendall(octets)
            else:
                s.sendall(octets)
                if manner == "half-closed":
                    s.shutdown(socket.SHUT_WR)
                if manner != "reset":
                    s.settimeout(0.02)
                    s.recv(65536)
            if manner == "reset":
                s.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        except OSError:
            pass


MANNERS = ("whole", "reset", "half-closed", "slow", "deaf")


class Program:
    """A `sentree` that stays, and what it says."""

    def __init__(self, *words, ready):
        self.words = words
        self.log = open(work / f"log-{len(os.listdir(work))}", "w+b")
        self.process = subprocess.Popen([sentree, *words], stdin=subprocess.DEVNULL, stdout=self.log, stderr=self.log, env=environment, start_new_session=True)
        until = time.monotonic() + kPatience_s
        while not ready(self) and self.process.poll() is None and time.monotonic() < until:
            threading.Event().wait(0.05)

    def said(self):
        return Path(self.log.name).read_text(errors="replace")

    def resident_kb(self):
        return int(re.search(r"VmHWM:\s*(\d+)", Path(f"/proc/{self.process.pid}/status").read_text())[1])

    def threads(self):
        return len(os.listdir(f"/proc/{self.process.pid}/task"))

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            code = self.process.wait(kPatience_s)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            code = "none: it does not stop"
        check(f"sentree {' '.join(map(str, self.words))[:80]} ends in order", code in (0, 1, 3, 124, 130), f"code {code}\n{self.said()}")
        check(f"sentree {' '.join(map(str, self.words))[:80]} says nothing of a crash", not CRASH.search(self.said()), self.said())


def listening(address):
    def ready(_):
        try:
            with socket.socket(socket.AF_UNIX if isinstance(address, str) else socket.AF_INET) as s:
                s.connect(address)
            return True
        except OSError:
            return False
    return ready


def attack(what, program, addresses, honest):
    before = None
    for name, address in addresses.items():
        port = address[1] if isinstance(address, tuple) else 1
        held = []  # silent ones, all at once
        for _ in range(30):
            s = socket.socket(socket.AF_UNIX if isinstance(address, str) else socket.AF_INET)
            s.setblocking(False)
            s.connect_ex(address)
            held.append(s)
        before = before or program.descriptors()
        for _ in range(options.rounds):
            for said, octets in payloads(port):
                manner = chance.choice(MANNERS)
                talk(address, octets, manner)
                if program.process.poll() is not None:
                    check(f"{what} at {name} survives \"{said}\", {manner}", False, f"code {program.process.returncode}\n{program.said()}")
                    return
        for s in held:
            s.close()
        check(f"{what} answers after what {name} heard", honest(), program.said())
    check(f"{what} keeps its memory within bounds", program.resident_kb() < kResident_kb, f"{program.resident_kb()} kB")
    check(f"{what} keeps its threads within bounds", program.threads() < 150, program.threads())


def sentree_says(*words):
    ran = subprocess.run([sentree, *words], stdin=subprocess.DEVNULL, capture_output=True, env=environment, timeout=kPatience_s)
    return ran.returncode == 0


def health(port, answer=b"200"):
    def ask():
        until = time.monotonic() + kPatience_s
        while time.monotonic() < until:  # it may be closing what others left
            try:
                with socket.create_connection(("127.0.0.1", port), 20) as s:
                    s.sendall(f"GET /api/health HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode())
                    if answer in s.recv(4096):
                        return True
            except OSError:
                pass
        return False
    return ask


def call(address, service="Battery", method="getBatteryState"):
    def ask():
        until = time.monotonic() + kPatience_s
        while time.monotonic() < until:  # connections that are silent are closed behind 10 s, when they are needed
            if sentree_says("call", address, method, "--interface", f"robot.thrift/{service}", "--deadline", "20 s"):
                return True
        return False
    return ask


# ---- listeners

def component():
    unix, port = str(work / "c.sock"), free_port()
    for what, listen, address in (("component at unix:", "unix:" + unix, unix), ("component at tcp:", f"tcp://127.0.0.1:{port}", ("127.0.0.1", port))):
        program = Program("component", "sim", "--world", source / "examples/minimal/world/world.yaml", "--listen", listen, ready=listening(address))
        attack(what, program, {what.split()[-1]: address}, call(listen, "Navigation", "getNavigationStatus"))
        program.stop()


def skill():
    port = free_port()
    program = Program("skill", source / "examples/minimal", "GoTo", "--listen", f"tcp://127.0.0.1:{port}", "--at", "navigation=tcp://127.0.0.1:9", "--at", "battery=tcp://127.0.0.1:9",
                      ready=listening(("127.0.0.1", port)))
    attack("skill", program, {"tcp:": ("127.0.0.1", port)}, lambda: True)
    check("the skill lives", program.process.poll() is None, program.said())
    program.stop()


def monitor():
    unix = str(work / "m.sock")
    program = Program("monitor", "--project", source / "examples/minimal", "--name", "leaves_charged", "--listen", "unix:" + unix, ready=listening(unix))
    attack("monitor", program, {"unix:": unix}, lambda: program.process.poll() is None)
    program.stop()


def studio():
    groot = 20000 + chance.randrange(20000)
    port, observed, foxglove = free_port(), free_port(), free_port()
    shutil.copytree(source / "examples/minimal", work / "minimal")
    (work / "minimal/scenarios/long.yaml").write_text("duration: 60 min\noverride: {mission: {repeat: true}}\nclock: real\n")
    program = Program("run", work / "minimal", "--scenario", "long", f"--studio={port}", f"--groot={groot}", f"--foxglove={foxglove}", "--listen", f"tcp://127.0.0.1:{observed}",
                      ready=listening(("127.0.0.1", port)))
    control = [str(p) for p in work.glob("**/*.sock") if p.is_socket()]
    addresses = {"the page": ("127.0.0.1", port), "the port of Groot 2": ("127.0.0.1", groot), "the port behind it": ("127.0.0.1", groot + 1), "the observers' port": ("127.0.0.1", observed),
                 "the port of Foxglove": ("127.0.0.1", foxglove)}
    addresses.update({f"the run's socket {Path(p).name}": p for p in control[:3]})
    attack("a run with a page, Groot and Foxglove", program, addresses, lambda: health(port)() and health(foxglove, b"426")())
    program.stop()
    port = free_port()
    program = Program("studio", work / "minimal", "--at", str(port), ready=listening(("127.0.0.1", port)))
    attack("a project in the page", program, {"the page": ("127.0.0.1", port)}, health(port))
    program.stop()
    runs = sorted((work / "runs").glob("*.mcap"))
    check("the run was recorded", bool(runs))
    if runs:
        port = free_port()
        program = Program("studio", runs[0], "--at", str(port), ready=listening(("127.0.0.1", port)))
        attack("a recording in the page", program, {"the page": ("127.0.0.1", port)}, health(port))
        program.stop()


def ports_of(pid):
    """TCP ports at which a process listens."""
    files = []
    for fd in os.listdir(f"/proc/{pid}/fd"):
        try:
            files.append(os.readlink(f"/proc/{pid}/fd/{fd}"))
        except OSError:
            pass
    inodes = {f[8:-1] for f in files if f.startswith("socket:")}
    lines = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    return [int(words[1].split(":")[1], 16) for words in lines if words[3] == "0A" and words[9] in inodes]


def yarp():
    names = free_port()
    environment["SENTREE_YARP_SERVER"] = f"127.0.0.1:{names}"
    program = Program("sim", "--world", source / "examples/minimal/world/world.yaml", "--yarp", "--headless", ready=listening(("127.0.0.1", names)))
    ports, until = [], time.monotonic() + kPatience_s
    while len(ports) < 3 and time.monotonic() < until and program.process.poll() is None:
        ports = ports_of(program.process.pid)
    others = [p for p in ports if p != names][:3]
    attack("the simulator at YARP", program, {"the name server": ("127.0.0.1", names), **{f"port {i}": ("127.0.0.1", p) for i, p in enumerate(others)}},
           lambda: sentree_says("call", "yarp:/battery/rpc:i", "getBatteryState", "--interface", "robot.thrift/Battery", "--deadline", "20 s"))
    program.stop()
    del environment["SENTREE_YARP_SERVER"]


# ---- clients: what serves lies

REPLY = thrift_call("getBatteryState", 1, 2)


def lies():
    yield "silence", None
    yield "the end", b""
    yield "noise", chance.randbytes(300)
    yield "zeros", bytes(5000)
    yield "half a reply", REPLY[:9]
    yield "a wrong number", thrift_call("getBatteryState", 99999, 2)
    yield "another method", thrift_call("somethingElse", 1, 2)
    yield "a call", thrift_call("getBatteryState", 1, 1)
    yield "an exception of a gigabyte", thrift_call("getBatteryState", 1, 3, body=b"\x0b\0\x01\x3f\xff\xff\xff")
    yield "a reply of two gigabytes", thrift_call("getBatteryState", 1, 2, body=b"\x0c\0\0\x0b\0\x01\x7f\xff\xff\xff")
    yield "wrong types", thrift_call("getBatteryState", 1, 2, body=b"\x0f\0\0\x0b\0\0\0\x01\0\0\0\x01x\0")
    yield "structs in structs", thrift_call("getBatteryState", 1, 2, body=b"\x0c\0\0" * 100_000)
    yield "a flood", REPLY * 20_000
    yield "an unknown message", thrift_call("getBatteryState", 1, 7)
    yield "not a number", thrift_call("getBatteryState", 1, 2, body=b"\x0c\0\0\x04\0\x01\x7f\xf8\0\0\0\0\0\0\0\0")
    yield "HTTP", b"HTTP/1.1 400 Bad Request\r\n\r\n"
    yield "drops", "drops"


def liar(listener, lie):
    """Serves one answer, whatever is asked, until its listener is closed."""
    def serve(peer):
        with peer:
            try:
                peer.settimeout(kPatience_s)
                while peer.recv(65536):
                    if lie == "drops":
                        for octet in REPLY:
                            peer.sendall(bytes([octet]))
                            if threading.Event().wait(0.02):
                                return
                    elif lie is not None:
                        peer.sendall(lie)
                        if not lie:
                            return
            except OSError:
                pass
    while True:
        try:
            peer, _ = listener.accept()
        except OSError:
            return
        threading.Thread(target=serve, args=(peer,), daemon=True).start()


def clients():
    """A mission asks a battery that lies: the skill's calls fail within their deadlines, and the run goes on to its end."""
    project = work / "lied-to"
    shutil.copytree(source / "examples/minimal", project)
    for index, (name, lie) in enumerate(lies()):
        count["peers"] += 1
        port = free_port()
        listener = socket.create_server(("127.0.0.1", port), backlog=64)
        threading.Thread(target=liar, args=(listener, lie), daemon=True).start()
        (project / "scenarios/lie.yaml").write_text(f'clock: {{real: 20}}\nduration: 8 s\noverride:\n  services: {{battery: {{at: "tcp://127.0.0.1:{port}"}}}}\n')
        words = ["run", str(project), "--scenario", "lie", "--json", "--no-record"] + (["--processes"] if index % 4 == 3 else [])
        log = open(work / "lied", "w+b")
        process = subprocess.Popen([sentree, *words], stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=environment, start_new_session=True)
        try:
            code = process.wait(kPatience_s)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            code = "it does not end"
        said = Path(log.name).read_text(errors="replace")
        check(f"a run whose battery answers with {name} ends in order", code in (0, 1, 124), f"code {code}\n{said}")
        check(f"a run whose battery answers with {name} says nothing of a crash", not CRASH.search(said), said)
        check(f"a run whose battery answers with {name} gives its report", '"monitors"' in said, said)
        listener.close()
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    check("nothing that was lied to takes more memory than its bounds", peak < kResident_kb, f"{peak} kB")


if options.only:
    globals()[options.only]()
for part in () if options.only else (component, skill, monitor, studio, yarp, clients):
    began, peers = time.monotonic(), count["peers"]
    part()
    print(f"{part.__name__}: {count['peers'] - peers} peers, {time.monotonic() - began:.0f} s", flush=True)
print(f"{count['peers']} peers, seed {options.seed}: {len(failures)} failures")
sys.exit(1 if failures else 0)
