#!/usr/bin/python3
"""An observer in Python: prints each message's name, and as a gate vetoes goals once the battery was seen below 30 %.

See docs/how-to/observer-in-another-language.md."""

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
subprocess.run(["thrift", "--gen", "py", "-out", generated.name, os.path.join(options.interfaces, "observer.thrift")], check=True)
sys.path.insert(0, generated.name)

from sentree.observer import Observer, ttypes  # noqa: E402
from thrift.protocol import TBinaryProtocol  # noqa: E402
from thrift.server import TServer  # noqa: E402
from thrift.transport import TSocket, TTransport  # noqa: E402


class LowBattery(Observer.Iface):
    def __init__(self):
        self.lock = threading.Lock()
        self.low = False

    def info(self):
        return ttypes.ObserverInfo(name="low_battery", pid=os.getpid(), observes=["*"], gates=["navigation.goto*"])

    def observe(self, message):
        with self.lock:
            print(message.sequence, message.name, flush=True)
            if message.name == "battery.getBatteryState.reply":
                self.low = json.loads(message.data)["result"]["percentage"] < 0.3
            goal = message.kind == ttypes.MessageKind.REQUEST and message.name.startswith("navigation.goto")
            if goal and self.low:
                return ttypes.Verdict(accept=False, reason="the battery is below 30 %")
            return ttypes.Verdict(accept=True)


class Listening(TSocket.TServerSocket):
    def listen(self):
        super().listen()
        where = "unix:" + options.socket if options.socket else "tcp://127.0.0.1:%d" % self.handle.getsockname()[1]
        print("listening at " + where, flush=True)


socket = Listening(unix_socket=options.socket) if options.socket else Listening(host="127.0.0.1", port=options.port)
TServer.TThreadedServer(Observer.Processor(LowBattery()), socket, TTransport.TBufferedTransportFactory(),
                        TBinaryProtocol.TBinaryProtocolFactory(), daemon=True).serve()
