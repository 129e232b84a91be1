#!/usr/bin/python3
"""A client in Python: asks a battery, wherever it is served, and prints its charge. ask_battery.py HOST PORT, or SOCKET."""

import os
import subprocess
import sys
import tempfile

generated = tempfile.TemporaryDirectory()
idl = os.path.join(os.path.dirname(__file__), "..", "..", "interfaces", "robot.thrift")
subprocess.run(["thrift", "--gen", "py", "-out", generated.name, idl], check=True)
sys.path.insert(0, generated.name)

from robot import Battery  # noqa: E402
from thrift.protocol import TBinaryProtocol  # noqa: E402
from thrift.transport import TSocket, TTransport  # noqa: E402

if len(sys.argv) == 3:
    socket = TSocket.TSocket(sys.argv[1], int(sys.argv[2]))
else:
    socket = TSocket.TSocket(unix_socket=sys.argv[1])
transport = TTransport.TBufferedTransport(socket)
transport.open()
state = Battery.Client(TBinaryProtocol.TBinaryProtocol(transport)).getBatteryState()
print("%.2f %s" % (state.percentage, state.header.frame_id))
transport.close()
