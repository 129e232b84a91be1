#!/usr/bin/python3
"""A component in Python: serves a battery that loses one percent a second. See docs/how-to/component-in-another-language.md."""

import argparse
import os
import sys
import tempfile
import subprocess
import time

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--interfaces", default=os.path.join(os.path.dirname(__file__), "..", "..", "interfaces"))
parser.add_argument("--port", type=int, default=0, help="0 takes a free one; it is printed")
parser.add_argument("--socket", help="serve on this Unix socket instead")
parser.add_argument("--compact", action="store_true", help="speak the compact protocol")
parser.add_argument("--framed", action="store_true", help="frame the messages")
options = parser.parse_args()

# Thrift's compiler writes the module `robot` from the IDL; here it is done at each start, into a folder that goes with us.
generated = tempfile.TemporaryDirectory()
subprocess.run(["thrift", "--gen", "py", "-out", generated.name, os.path.join(options.interfaces, "robot.thrift")], check=True)
sys.path.insert(0, generated.name)

from robot import Battery, ttypes  # noqa: E402
from thrift.protocol import TBinaryProtocol, TCompactProtocol  # noqa: E402
from thrift.server import TServer  # noqa: E402
from thrift.transport import TSocket, TTransport  # noqa: E402


class Handler(Battery.Iface):
    def __init__(self):
        self.started = time.monotonic()

    def getBatteryCharge(self):
        return max(0.0, 100.0 - (time.monotonic() - self.started))

    def isCharging(self):
        return False

    def getBatteryState(self):
        charge = self.getBatteryCharge() / 100.0
        return ttypes.BatteryState(
            header=ttypes.Header(stamp=time.monotonic() - self.started, frame_id="base_link"),
            voltage=22.0 + 4.0 * charge, current=-1.5, percentage=charge, temperature=25.0,
            power_supply_status=ttypes.PowerSupplyStatus.DISCHARGING,
            warning=ttypes.BatteryWarning.NONE, present=True)


class Listening(TSocket.TServerSocket):
    """Says where it listens as soon as it does, so that whoever started us can connect."""

    def listen(self):
        super().listen()
        where = "unix:" + options.socket if options.socket else "tcp://127.0.0.1:%d" % self.handle.getsockname()[1]
        print("listening at " + where, flush=True)


socket = Listening(unix_socket=options.socket) if options.socket else Listening(host="127.0.0.1", port=options.port)
transports = TTransport.TFramedTransportFactory() if options.framed else TTransport.TBufferedTransportFactory()
protocols = TCompactProtocol.TCompactProtocolFactory() if options.compact else TBinaryProtocol.TBinaryProtocolFactory()
TServer.TThreadedServer(Battery.Processor(Handler()), socket, transports, protocols, daemon=True).serve()
