#!/usr/bin/python3
"""A skill in Python: RUNNING for as many ticks as its port `ticks` says, then SUCCESS. See docs/how-to/skill-in-another-language.md."""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import threading

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--interfaces", default=os.path.join(os.path.dirname(__file__), "..", "..", "interfaces"))
parser.add_argument("--port", type=int, default=0, help="0 takes a free one; it is printed")
parser.add_argument("--socket", help="serve on this Unix socket instead")
options = parser.parse_args()

generated = tempfile.TemporaryDirectory()
subprocess.run(["thrift", "--gen", "py", "-out", generated.name, os.path.join(options.interfaces, "skill.thrift")], check=True)
sys.path.insert(0, generated.name)

from sentree.skill import Skill, ttypes  # noqa: E402
from thrift.protocol import TBinaryProtocol  # noqa: E402
from thrift.server import TServer  # noqa: E402
from thrift.transport import TSocket, TTransport  # noqa: E402


class Countdown(Skill.Iface):
    """One countdown per leaf; a new run number starts it anew."""

    def __init__(self):
        self.lock = threading.Lock()
        self.runs = {}  # leaf -> [run, ticks left]

    def info(self):
        return ttypes.SkillInfo(name="Countdown", pid=os.getpid())

    def tick(self, tick):
        with self.lock:
            if self.runs.get(tick.leaf, [None])[0] != tick.run:
                self.runs[tick.leaf] = [tick.run, int(json.loads(tick.inputs).get("ticks", 3))]
            state = self.runs[tick.leaf]
            state[1] -= 1
            if state[1] > 0:
                return ttypes.TickReply(status=ttypes.Status.RUNNING)
            return ttypes.TickReply(status=ttypes.Status.SUCCESS, outputs=json.dumps({"left": 0}))

    def halt(self, leaf, run):
        self.cancel(leaf, run)
        return ttypes.HaltReply(halted=True)

    def cancel(self, leaf, run):
        with self.lock:
            if self.runs.get(leaf, [None])[0] == run:
                del self.runs[leaf]

    def reset(self):
        with self.lock:
            self.runs.clear()


class Listening(TSocket.TServerSocket):
    def listen(self):
        super().listen()
        where = "unix:" + options.socket if options.socket else "tcp://127.0.0.1:%d" % self.handle.getsockname()[1]
        print("listening at " + where, flush=True)


socket = Listening(unix_socket=options.socket) if options.socket else Listening(host="127.0.0.1", port=options.port)
TServer.TThreadedServer(Skill.Processor(Countdown()), socket, TTransport.TBufferedTransportFactory(),
                        TBinaryProtocol.TBinaryProtocolFactory(), daemon=True).serve()
