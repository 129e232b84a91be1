#!/usr/bin/python3
"""The cell as a component: serves Arm and Camera, with a gripper that closes on nothing at every third try."""

import argparse
import os
import subprocess
import sys
import tempfile
import threading
import time

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--port", type=int, default=0, help="0 takes a free one; it is printed")
parser.add_argument("--socket", help="serve on this Unix socket instead")
options = parser.parse_args()

# Thrift's compiler writes the module `cell` from the IDL, into a folder that goes with us.
generated = tempfile.TemporaryDirectory()
idl = os.path.join(os.path.dirname(os.path.abspath(__file__)), "interfaces", "cell.thrift")
subprocess.run(["thrift", "--gen", "py", "-out", generated.name, idl], check=True)
sys.path.insert(0, generated.name)

from cell import Arm, Camera  # noqa: E402
from cell.ttypes import ArmStatus  # noqa: E402
from thrift.TMultiplexedProcessor import TMultiplexedProcessor  # noqa: E402
from thrift.protocol import TBinaryProtocol  # noqa: E402
from thrift.server import TServer  # noqa: E402
from thrift.transport import TSocket, TTransport  # noqa: E402

MOVEMENT_S = 0.3


class Cell:
    """What arm and camera share. Calls come in threads of their own."""

    def __init__(self):
        self.lock = threading.Lock()
        self.parts = ["bolt", "nut", "washer"]
        self.tries = 0
        self.ends_at = 0.0
        self.then = ArmStatus.IDLE

    def findPart(self):
        with self.lock:
            return self.parts[0] if self.parts else ""

    def pick(self, part):
        with self.lock:
            self.tries += 1
            self.move(ArmStatus.EMPTY if self.tries % 3 == 0 else ArmStatus.HOLDING)

    def place(self, bin):
        with self.lock:
            if self.then == ArmStatus.HOLDING:
                self.parts.pop(0)
            self.move(ArmStatus.IDLE)

    def home(self):
        with self.lock:
            self.move(ArmStatus.IDLE)

    def getStatus(self):
        with self.lock:
            return ArmStatus.MOVING if time.monotonic() < self.ends_at else self.then

    def move(self, then):
        self.ends_at = time.monotonic() + MOVEMENT_S
        self.then = then


class Listening(TSocket.TServerSocket):
    """Says where it listens as soon as it does."""

    def listen(self):
        super().listen()
        where = "unix:" + options.socket if options.socket else "tcp://127.0.0.1:%d" % self.handle.getsockname()[1]
        print("listening at " + where, flush=True)


cell = Cell()
processor = TMultiplexedProcessor()
processor.registerProcessor("arm", Arm.Processor(cell))
processor.registerProcessor("camera", Camera.Processor(cell))
socket = Listening(unix_socket=options.socket) if options.socket else Listening(host="127.0.0.1", port=options.port)
TServer.TThreadedServer(processor, socket, TTransport.TBufferedTransportFactory(),
                        TBinaryProtocol.TBinaryProtocolFactory(), daemon=True).serve()
