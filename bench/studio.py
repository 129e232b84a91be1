#!/usr/bin/env python3
"""What the studio costs, with nothing but a `sentree` program and Python.

  bench/studio.py build/release/bin/sentree [RECORDING]

Prints: time from the command to the first state in a page; processor time that the page adds to a run, with nobody
looking and with one page; of a recording of an hour, or of RECORDING alone: time until it is shown, until all of it has
been read, and to show a moment of what has been read; memory.
"""
import json
import os
import re
import resource
import socket
import statistics
import subprocess
import sys
import tempfile
import time

PROJECT = os.path.join(os.path.dirname(__file__), "..", "examples", "recharge")


class Page:
    """A page's side of the WebSocket."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=60)
        self.data = b""
        self.socket.sendall(
            f"GET /api/ws HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n".encode()
        )
        while b"\r\n\r\n" not in self.data:
            self.fill()
        self.data = self.data.split(b"\r\n\r\n", 1)[1]

    def fill(self):
        got = self.socket.recv(1 << 16)
        if not got:
            raise EOFError
        self.data += got

    def take(self, count):
        while len(self.data) < count:
            self.fill()
        taken, self.data = self.data[:count], self.data[count:]
        return taken

    def receive(self):
        head = self.take(2)
        size = head[1] & 127
        if size > 125:
            size = int.from_bytes(self.take(2 if size == 126 else 8), "big")
        return json.loads(self.take(size)) if head[0] & 15 == 1 else self.take(size)

    def until(self, kind):
        while True:
            message = self.receive()
            if isinstance(message, dict) and message["type"] == kind:
                return message

    def send(self, request):
        text = json.dumps(request).encode()
        # The shortest form of the length, or the server ends the connection (RFC 6455, 5.2).
        length = bytes([0x80 | len(text)]) if len(text) < 126 else b"\xfe" + len(text).to_bytes(2, "big")
        self.socket.sendall(b"\x81" + length + bytes(4) + text)


def connect(port):
    while True:
        try:
            return Page(port)
        except OSError:
            time.sleep(0.005)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def processor_time(arguments, look=None):
    """Seconds of processor time of a command until it ends."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    if look:
        look()
    process.wait()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def memory(process):
    """Most memory that it had so far [MB]."""
    with open(f"/proc/{process.pid}/status", encoding="ascii") as status:
        return int(re.search(r"VmHWM:\s+(\d+)", status.read())[1]) / 1e3


def look_at_moments(page, end, when):
    """Moments all over the recording, none twice."""
    waits = []
    for i in range(200):
        begin = time.monotonic()
        page.send({"op": "seek", "id": i + 1, "time": (i * 7919 % 200) * end // 200 + i})
        page.until("answer")
        waits.append(time.monotonic() - begin)
    print(f"  a moment, {when}: {statistics.median(waits) * 1e3:.1f} ms (median), {max(waits) * 1e3:.1f} ms (most of 200)")


def open_recording(program, recording):
    port = free_port()
    begin = time.monotonic()
    process = subprocess.Popen([program, "studio", recording, "--at", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    page = connect(port)
    end = page.until("state")["end"]
    print(f"a recording of {os.path.getsize(recording) / 1e6:.0f} MB: shown after {time.monotonic() - begin:.2f} s, {memory(process):.0f} MB, its first {end / 60e9:.0f} min")
    look_at_moments(page, end, "while it is read")
    # A page that comes is told how much has been read.
    reason = "has been read"
    while "has been read" in reason:
        page.socket.close()
        time.sleep(0.1)
        page = connect(port)
        state = page.until("state")
        end, reason = state["end"], state["run"]["reason"]
    print(f"  all {end / 60e9:.0f} min known after {time.monotonic() - begin:.2f} s, {memory(process):.0f} MB")
    look_at_moments(page, end, "all known")
    process.terminate()
    process.wait()


def main():
    program = sys.argv[1]
    if len(sys.argv) > 2:
        os.environ["SENTREE_RUNS"] = ""
        open_recording(program, sys.argv[2])
        return
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"SENTREE_RUNS": ""}
        os.environ.update(environment)
        run = [program, "run", PROJECT, "--scenario", "experiment1"]

        firsts = []
        for _ in range(5):
            port = free_port()
            begin = time.monotonic()
            process = subprocess.Popen(run + [f"--studio={port}", "--factor", "4"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            connect(port).until("state")
            firsts.append(time.monotonic() - begin)
            process.terminate()
            process.wait()
        print(f"first state after the command: {min(firsts) * 1e3:.0f} ms (least of 5), {statistics.median(firsts) * 1e3:.0f} ms (median)")

        def look(port):
            page = connect(port)
            try:
                while True:
                    page.receive()
            except (EOFError, OSError):
                pass

        seconds = 4
        timed = run + ["--factor", "4", "--duration", f"{seconds * 4} s", "--clock", "real"]
        without, alone, watched = [], [], []
        for _ in range(3):
            port = free_port()
            recorded = ["--record", os.path.join(folder, "a.mcap")]
            without.append(processor_time(timed + recorded))
            alone.append(processor_time(timed + recorded + [f"--studio={port}", "--studio-exit"]))
            watched.append(processor_time(timed + recorded + [f"--studio={port}", "--studio-exit"], lambda: look(port)))
        for name, times in (("nobody looks", alone), ("one page looks", watched)):
            added = min(times) - min(without)
            print(f"a run of {seconds} s at factor 4: {min(without):.2f} s of processor time; when {name}, {added:+.2f} s "
                  f"({added / seconds:+.1%} of a processor)")

        recording = os.path.join(folder, "hour.mcap")
        subprocess.run(run + ["--clock", "virtual", "--duration", "60 min", "--record", recording], stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL, check=False)
        open_recording(program, recording)


main()
