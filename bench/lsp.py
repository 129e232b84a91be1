#!/usr/bin/env python3
"""How long the language server takes on a project of 300 leaves that run 60 charts, in ms of processor time.

  bench/lsp.py build/release/bin/sentree [SENTREE...]

With several programs they are measured in turns, so that they see the same machine. Each letter typed into a chart, into
the mission and into the requirements is followed until the findings are published; then some questions are asked. Prints
the median of ROUNDS each. The project is the recharge example with its leaf GoToLocation once more per chart.
"""
import json
import os
import re
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile

PROJECT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "examples", "recharge"))
CHARTS = 60
LEAVES_PER_CHART = 5
ROUNDS = 9


def write_project(folder):
    shutil.copytree(PROJECT, folder)
    shutil.rmtree(os.path.join(folder, "scenarios"))
    os.remove(os.path.join(folder, "campaign.yaml"))
    with open(os.path.join(folder, "skills", "GoToLocation.scxml"), encoding="utf-8") as file:
        chart = file.read()
    leaves, models = "", ""
    for i in range(CHARTS):
        with open(os.path.join(folder, "skills", f"Go{i}.scxml"), "w", encoding="utf-8") as file:
            file.write(chart.replace('name="GoToLocation"', f'name="Go{i}"'))
        leaves += "".join(f'<Go{i} name="Go{i}_{k}" destination="kitchen"/>\n' for k in range(LEAVES_PER_CHART))
        models += f'<Action ID="Go{i}"><input_port name="destination" type="std::string"/></Action>\n'
    path = os.path.join(folder, "mission.xml")
    with open(path, encoding="utf-8") as file:
        mission = file.read()
    with open(path, "w", encoding="utf-8") as file:
        end = mission.index('<ReactiveFallback name="BeAtKitchen">')
        file.write((mission[:end] + f'<Sequence name="Rounds">\n{leaves}</Sequence>\n' + mission[end:]).replace("<TreeNodesModel>", "<TreeNodesModel>\n" + models))


class Server:
    def __init__(self, program, folder):
        self.process = subprocess.Popen([program, "lsp"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        self.id = 0
        self.uri = f"file://{folder}"
        self.request("initialize", {"processId": None, "rootUri": self.uri, "capabilities": {}})
        self.send("initialized", {})

    def send(self, method, params, **more):
        body = json.dumps({"jsonrpc": "2.0", "method": method, "params": params, **more}).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        self.process.stdin.flush()

    def receive(self):
        length = 0
        while (line := self.process.stdout.readline().strip()) or not length:
            if match := re.match(rb"Content-Length: (\d+)", line):
                length = int(match[1])
        return json.loads(self.process.stdout.read(length))

    def request(self, method, params):
        self.id += 1
        self.send(method, params, id=self.id)
        while (message := self.receive()).get("id") != self.id or "method" in message:
            pass
        return message

    def cpu_ms(self):
        with open(f"/proc/{self.process.pid}/schedstat", encoding="utf-8") as file:
            return int(file.read().split()[0]) / 1e6

    def timed(self, action):
        before = self.cpu_ms()
        action()
        return self.cpu_ms() - before

    def until_findings(self, name, wanted):
        while True:
            message = self.receive()
            params = message.get("params", {})
            if message.get("method") == "textDocument/publishDiagnostics" and params["uri"].endswith(name):
                if any(wanted in finding["message"] for finding in params["diagnostics"]):
                    return


def measure(program):
    with tempfile.TemporaryDirectory() as root:
        folder = os.path.join(root, "project")
        write_project(folder)
        server = Server(program, folder)
        # What is typed, so that each letter makes another finding: file, what it replaces, a text for round i, its message.
        edits = {
            "chart": ("skills/Go7.scxml", "result.code === 'OK'", "result.code{i} === 'OK'", "code{i}"),
            "mission": ("mission.xml", 'location="station"', 'location="statio{i}"', "statio{i}"),
            "requirement": ("requirements/recharge.req", "percentage", "percentag{i}", "percentag{i}"),
        }
        results = {}
        for what, (name, old, new, message) in edits.items():
            with open(os.path.join(folder, name), encoding="utf-8") as file:
                text = file.read()
            assert old in text, f"{name} has no {old}"
            uri = f"{server.uri}/{name}"
            server.send("textDocument/didOpen", {"textDocument": {"uri": uri, "languageId": "x", "version": 1, "text": text}})
            times = []
            for i in range(ROUNDS + 2):
                def change(i=i):
                    changed = text.replace(old, new.format(i=i), 1)
                    server.send("textDocument/didChange", {"textDocument": {"uri": uri, "version": i + 2}, "contentChanges": [{"text": changed}]})
                    server.until_findings(name, message.format(i=i))
                times.append(server.timed(change))
            results[f"findings, {what}"] = statistics.median(times[2:])
            server.send("textDocument/didChange", {"textDocument": {"uri": uri, "version": 99}, "contentChanges": [{"text": text}]})
        at = {"textDocument": {"uri": f"{server.uri}/mission.xml"}, "position": {"line": 30, "character": 8}}
        for method in ("completion", "hover", "definition", "documentSymbol", "formatting"):
            params = {**at, "options": {"tabSize": 2, "insertSpaces": True}}
            times = [server.timed(lambda: server.request(f"textDocument/{method}", params)) for _ in range(ROUNDS)]
            results[method] = statistics.median(times)
        server.process.kill()
        server.process.wait()
        return results


def main():
    signal.alarm(900)  # a server that never publishes what is waited for
    programs = [os.path.abspath(program) for program in sys.argv[1:]]
    if not programs:
        sys.exit(__doc__)
    measured = [measure(program) for program in programs]
    for what in measured[0]:
        print(f"{what:24}" + "".join(f"{result[what]:10.1f}" for result in measured))


main()
