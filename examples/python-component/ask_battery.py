#!/usr/bin/python3
"""A client in Python: asks a battery, wherever it is served, and prints its charge. ask_battery.py HOST PORT, or SOCKET."""

import argparse
import os
import subprocess
import sys
import tempfile

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("where", nargs="+", help="HOST PORT, or the path of a Unix socket")
parser.add_argument("--service", help="a server of several services is asked for one by its name")
options = parser.parse_args()

generated = tempfile.TemporaryDirectory()
idl = os.path.join(os.path.dirname(__file__), "..", "..", "interfaces", "robot.thrift")
subprocess.run(["thrift", "--gen", "py", "-out", generated.name, idl], check=True)
sys.path.insert(0, generated.name)

from robot import Battery  # noqa: E402
from thrift.protocol import TBinaryProtocol, TMultiplexedProtocol  # noqa: E402
from thrift.transport import TSocket, TTransport  # noqa: E402

if len(options.where) == 2:
    socket = TSocket.TSocket(options.where[0], int(options.where[1]))
else:
    socket = TSocket.TSocket(unix_socket=options.where[0])
transport = TTransport.TBufferedTransport(socket)
transport.open()
protocol = TBinaryProtocol.TBinaryProtocol(transport)
if options.service:
    protocol = TMultiplexedProtocol.TMultiplexedProtocol(protocol, options.service)
state = Battery.Client(protocol).getBatteryState()
print("%.2f %s" % (state.percentage, state.header.frame_id))
transport.close()
