#!/usr/bin/env python3
"""A durable run whose simulator is a process of its own: it survives the executive and is found again; one that died
meanwhile is started again.

usage: durable_parts_test.py SENTREE SOURCE_DIR WORK_DIR
"""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

from restless import restless_recharge

PATIENCE_S = 240


class Test:
    def __init__(self, sentree, source, work):
        self.sentree, self.source, self.work = sentree, source, work
        shutil.rmtree(work, ignore_errors=True)
        os.makedirs(work)
        # Sockets want short names.
        self.runs = tempfile.mkdtemp(prefix="sentree-parts-")
        self.environment = dict(os.environ, SENTREE_RUNS=self.runs, XDG_RUNTIME_DIR=self.runs)
        project = restless_recharge(source, work)
        self.scenario = os.path.join(work, "mission.yaml")
        with open(self.scenario, "w", encoding="utf-8") as file:
            file.write(f"""project: {project}
clock: {{real: 20}}
processes: {{robot: {{component: sim, listen: "unix:{{run}}/robot.sock", restarts: 5}}}}
override:
  services: {{battery: {{at: "{{robot}}"}}, navigation: {{at: "{{robot}}"}}}}
  world: {{battery: {{initial: 100 %}}}}
  # The machine may be slow; the mission is not what is tested for speed here.
  deadlines: {{call: 2 s, condition: 4 s, budget: 5 s, unresponsive: 10 s}}
duration: 60 min
""")

    def start(self, *arguments):
        return subprocess.Popen([self.sentree, "run", *arguments, "--verbose"], cwd=self.work, env=self.environment,
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                errors="replace")  # what is left in the end may begin within a character

    def until(self, run, text, lines=1):
        """Reads what the run prints until `text` came so often."""
        seen = []
        for line in run.stdout:
            seen.append(line)
            lines -= text in line
            if lines <= 0:
                return
        raise AssertionError(f"the run ended without {text}: {''.join(seen[-40:])}")

    def parts(self):
        """Process ids of simulators of this test."""
        found = []
        for pid in os.listdir("/proc"):
            if not pid.isdigit():
                continue
            try:
                with open(f"/proc/{pid}/cmdline", "rb") as file:
                    command = file.read().split(b"\0")
            except OSError:
                continue
            if b"component" in command and self.scenario.encode() in command:
                found.append(int(pid))
        return found

    def robot(self):
        """A connection to the simulator."""
        folder = next(name for name in os.listdir(self.runs) if name.endswith(".parts"))
        connection = socket.socket(socket.AF_UNIX)
        connection.connect(os.path.join(self.runs, folder, "robot.sock"))
        return connection

    def annoy(self):
        """Gives it something to complain about, where nobody reads that any more."""
        with self.robot() as connection:
            connection.sendall(b"\xff" * 64)
            connection.shutdown(socket.SHUT_WR)
            while connection.recv(4096):
                pass

    def await_moment(self, moment, before):
        """Until the part that ends is gone, another is there, or that listens."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            now = self.parts()
            if now == before:
                continue
            if moment == "gone" or (moment == "there" and now):
                return
            if moment == "listens" and now:
                try:
                    self.robot().close()
                    return
                except OSError:
                    continue
        raise AssertionError(f"{moment}: {before}, {self.parts()}")

    def kill(self, process):
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()

    def replace(self):
        """Another project takes over: with its scenario of the same name, and told where it has none."""
        old, new = os.path.join(self.work, "old"), os.path.join(self.work, "new")
        recharge = os.path.join(self.source, "examples", "recharge")
        shutil.copytree(recharge, old)
        shutil.copytree(recharge, new)
        with open(os.path.join(new, "skills", "WaitForUser.scxml"), "r+", encoding="utf-8") as file:
            text = file.read().replace("</scxml>", "  <state id=\"served\"/>\n</scxml>")
            file.seek(0)
            file.write(text)
        for ends in (True, False):
            run = self.start(old, "--scenario", "recharge", "--clock", "real", "--factor", "50", "--durable")
            try:
                self.until(run, "getNavigationState.reply", 20)
                self.kill(run)
                run = self.start("--resume", "--project", new)
                if ends:
                    self.until(run, "recharge: mission SUCCESS")
                    run.communicate(timeout=PATIENCE_S)
                    assert run.returncode == 0, run.returncode
                else:
                    self.until(run, "what was still to come of the timeline of recharge does not come")
            finally:
                if run.poll() is None:
                    self.kill(run)
            if ends:
                os.remove(os.path.join(new, "scenarios", "recharge.yaml"))
        print("✓ another project takes over, with what is still to come of its scenario of that name, or without")
        for name in os.listdir(self.runs):
            if name.endswith((".mcap", ".journal")):
                os.remove(os.path.join(self.runs, name))

    def run(self):
        run = self.start(self.scenario, "--durable")
        processes = [run]
        try:
            self.until(run, "getNavigationState.reply", 20)
            first = self.parts()
            assert len(first) == 1, first
            self.kill(run)
            assert self.parts() == first, "the simulator died with its executive"
            self.annoy()

            run = self.start("--resume")
            processes.append(run)
            self.until(run, "mission.resumed")
            self.until(run, "getNavigationState.reply", 20)
            assert self.parts() == first, "the simulator was not found again"
            print("✓ what survived is found again")

            self.kill(run)
            os.kill(first[0], signal.SIGKILL)
            deadline = time.monotonic() + PATIENCE_S
            while self.parts() and time.monotonic() < deadline:
                pass
            run = self.start("--resume")
            processes.append(run)
            self.until(run, "mission.resumed")
            self.until(run, "! process robot ended while nobody was there and is started again at ")
            for told in ("process.exited", "process.restarted"):
                self.until(run, told)
            # A robot that begins anew stands at its start, and is sent to the kitchen again.
            self.until(run, "getNavigationState.reply", 20)
            second = self.parts()
            assert len(second) == 1 and second != first, (first, second)
            print("✓ what died is started again")

            # While the run goes on, too: that is observed, and once.
            os.kill(second[0], signal.SIGKILL)
            self.until(run, "process.restarted")
            third = self.parts()
            self.kill(run)
            run = self.start("--resume")
            processes.append(run)
            self.until(run, "getNavigationState.reply", 20)
            assert self.parts() == third, (third, self.parts())
            print("✓ one that was started again is found again")

            for moment in ("gone", "there", "listens") * 2:
                last = self.parts()
                os.kill(last[0], signal.SIGKILL)
                self.await_moment(moment, last)
                self.kill(run)
                run = self.start("--resume")
                processes.append(run)
                self.until(run, "mission.resumed")
                self.until(run, "getNavigationState.reply", 20)
                assert len(self.parts()) == 1 and self.parts() != last, (moment, last, self.parts())
            print("✓ so is one that was being started when the executive died, and no other one is left")

            run.send_signal(signal.SIGINT)
            text = run.communicate(timeout=PATIENCE_S)[0]
            assert run.returncode == 130, (run.returncode, text[-2000:])
            assert not self.parts(), "it outlives a run that ends in order"
            names = sorted(os.path.splitext(name)[1] for name in os.listdir(self.runs))
            assert ".parts" not in names and names.count(".mcap") == 10, names
            seen, latest, expected, resumes = set(), {}, 1, False
            for name in self.chain():
                for message in self.messages(name):
                    assert message["sequence"] == expected, (name, message, expected)
                    expected += 1
                    resumes = message["name"] == "mission.resumed" or (resumes and message["name"].startswith("process."))
                    if message["name"] == "process.restarted":
                        # One of which the executive had observed that it was started again, and died before it had
                        # noted where that is found, is told once more by who goes on. Numbers of processes come again
                        # on a busy machine, but not for the next process of one name.
                        process, pid = message["data"]["process"], message["data"]["pid"]
                        assert resumes or latest.get(process) != pid, message
                        latest[process] = pid
                        seen.add(pid)
            assert third[0] in seen, (third, seen)
            print(f"✓ {expected - 1} observations, each once")

            self.environment["SENTREE_ORPHANS_WAIT"] = "1"
            run = self.start(self.scenario, "--durable")
            processes.append(run)
            self.until(run, "getNavigationState.reply")
            assert self.parts()
            self.kill(run)
            deadline = time.monotonic() + PATIENCE_S
            while self.parts():
                assert time.monotonic() < deadline, "it waits for ever for who resumes its run"
            print("✓ what nobody resumes ends")
        finally:
            for process in processes:
                if process.poll() is None:
                    process.kill()
                    process.wait()
            for pid in self.parts():
                os.kill(pid, signal.SIGKILL)
            shutil.rmtree(self.runs, ignore_errors=True)

    def facts(self, name):
        done = subprocess.run([self.sentree, "info", os.path.join(self.runs, name), "--json"], stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, timeout=PATIENCE_S, check=True)
        return json.loads(done.stdout)["metadata"]

    def chain(self):
        """Names of the recordings, the first first."""
        facts = {name: self.facts(name) for name in os.listdir(self.runs) if name.endswith(".mcap")}
        order = [name for name, fact in facts.items() if "sentree.result" in fact]
        assert len(order) == 1, order
        while before := facts[order[0]]["sentree.run"].get("continues"):
            order.insert(0, before)
        return order

    def messages(self, name):
        done = subprocess.run([self.sentree, "export", os.path.join(self.runs, name), "--to", "ndjson"],
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        # One that was killed before its first observation reached the disk: the next has what the journal had.
        assert done.returncode == 0 or "it has no topic /observations" in done.stderr, done.stderr
        for line in done.stdout.splitlines():
            entry = json.loads(line)
            if entry["topic"] == "/observations":
                yield entry.get("message", entry.get("data"))


if __name__ == "__main__":
    test = Test(*(os.path.abspath(path) for path in sys.argv[1:4]))
    test.replace()
    test.run()
