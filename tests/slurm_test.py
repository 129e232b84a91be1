#!/usr/bin/env python3
"""A campaign as a Slurm array on a cluster of this machine alone: merged, it is what one process gives, byte for byte.

usage: slurm_test.py SENTREE SOURCE_DIR WORK_DIR
Exit code 77: skipped, Slurm or munge is not installed, this is not root, or there is no network at all.
"""

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time

RUNS = 12
SHARDS = 3
PATIENCE_S = 240
PROGRAMS = ["slurmctld", "slurmd", "munged", "sbatch", "sinfo"]


def free_ports(count):
    """Of TCP, each another: all are held until the last is known."""
    held = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [server.getsockname()[1] for server in held]
    for server in held:
        server.close()
    return ports


class Cluster:
    def __init__(self, folder):
        self.folder = folder
        self.running = []
        self.environment = dict(os.environ, SLURM_CONF=self.path("slurm.conf"))

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def start(self, name, *command):
        with open(self.path(name + ".log"), "w", encoding="utf-8") as log:
            self.running.append(subprocess.Popen([shutil.which(name), *command], env=self.environment, cwd=self.folder,
                                                 stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT))

    def logs(self):
        text = ""
        for name in ("munged", "slurmctld", "slurmd"):
            with open(self.path(name + ".log"), encoding="utf-8", errors="replace") as log:
                text += f"--- {name}\n" + log.read()[-3000:]
        return text

    def until(self, what, is_so):
        deadline = time.monotonic() + PATIENCE_S
        while not is_so():
            ended = [process.args[0] for process in self.running if process.poll() is not None]
            assert not ended, f"{ended} ended while waiting for {what}\n{self.logs()}"
            assert time.monotonic() < deadline, f"no {what}\n{self.logs()}"

    def begin(self):
        for name in ("state", "spool"):
            os.makedirs(self.path(name))
        with open(self.path("munge.key"), "wb") as key:
            key.write(os.urandom(128))
        os.chmod(self.path("munge.key"), 0o400)
        os.chmod(self.folder, 0o755)  # munge trusts no folder that others may write to
        munge = self.path("munge.sock")
        controller, node = free_ports(2)
        host = socket.gethostname().split(".")[0]
        with open(self.path("slurm.conf"), "w", encoding="utf-8") as file:
            file.write(f"""ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
SlurmctldPort={controller}
SlurmdPort={node}
AuthType=auth/munge
AuthInfo=socket={munge}
StateSaveLocation={self.path("state")}
SlurmdSpoolDir={self.path("spool")}
SlurmctldPidFile={self.path("slurmctld.pid")}
SlurmdPidFile={self.path("slurmd.pid")}
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
ReturnToService=2
SlurmdParameters=config_overrides
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
""")
        self.start("munged", "--foreground", "--force", f"--socket={munge}", f"--key-file={self.path('munge.key')}",
                   f"--pid-file={self.path('munged.pid')}", f"--seed-file={self.path('munged.seed')}")
        self.until("socket of munge", lambda: os.path.exists(munge))
        self.start("slurmctld", "-D", "-f", self.path("slurm.conf"))
        self.start("slurmd", "-D", "-f", self.path("slurm.conf"), "-N", host)
        self.until("idle node", lambda: "idle" in self.ask("sinfo", "--noheader", "--format=%T"))

    def ask(self, *command):
        done = subprocess.run(command, env=self.environment, cwd=self.folder, stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        return done.stdout

    def end(self):
        for process in reversed(self.running):
            if process.poll() is None:
                process.terminate()
        for process in self.running:
            try:
                process.wait(timeout=30)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def campaign(sentree, work, *arguments):
    done = subprocess.run([sentree, "campaign", *arguments], cwd=work, stdin=subprocess.DEVNULL, capture_output=True,
                          text=True, timeout=PATIENCE_S, check=False)
    assert done.returncode in (0, 1), done.stdout + done.stderr
    return done.returncode


def read(*path):
    with open(os.path.join(*path), "rb") as file:
        return file.read()


def main():
    sentree, source, work = (os.path.abspath(path) for path in sys.argv[1:4])
    missing = [name for name in PROGRAMS if shutil.which(name) is None]
    if missing or os.geteuid() != 0:
        print(f"SKIPPED: {', '.join(missing) + ' not installed' if missing else 'a cluster of its own needs root'}; "
              "cli_test.sh runs the same script in a loop")
        return 77
    try:
        # As slurmd asks: without an interface beside loopback it finds no address to listen at.
        socket.getaddrinfo(None, "0", family=socket.AF_INET, flags=socket.AI_ADDRCONFIG | socket.AI_PASSIVE)
    except socket.gaierror as error:
        print(f"SKIPPED: slurmd needs a network interface ({error}); cli_test.sh runs the same script in a loop")
        return 77
    shutil.rmtree(work, ignore_errors=True)
    os.makedirs(os.path.join(work, "bin"))
    os.symlink(sentree, os.path.join(work, "bin", "sentree"))
    vary = os.path.join(work, "vary.yaml")
    with open(vary, "w", encoding="utf-8") as file:
        # Nothing is violated: there are no least scenarios, of which each folder would have its own.
        file.write("duration: 20 s\nparameters: {world.battery.initial: {uniform: [50 %, 100 %]}}\n")
    project = os.path.join(source, "examples", "recharge")
    options = ["--vary", vary, "-n", str(RUNS), "--no-shrink"]
    code = campaign(sentree, work, project, *options, "--out", "alone")

    # Sockets want short names.
    cluster = Cluster(tempfile.mkdtemp(prefix="sentree-slurm-"))
    try:
        cluster.begin()
        environment = dict(cluster.environment, PATH=os.path.join(work, "bin") + ":" + os.environ["PATH"])
        batch = subprocess.run(["sbatch", "--wait", f"--array=1-{SHARDS}", "--cpus-per-task=1",
                                f"--output={work}/task-%a.log",
                                os.path.join(source, "examples", "batch", "campaign.slurm"), project,
                                os.path.join(work, "parts"), *options], cwd=work, env=environment,
                               stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=PATIENCE_S,
                               check=False)
        told = "".join(read(work, f"task-{i}.log").decode() for i in range(1, SHARDS + 1)
                       if os.path.exists(os.path.join(work, f"task-{i}.log")))
        assert batch.returncode == 0, batch.stdout + batch.stderr + told + cluster.logs()
    finally:
        cluster.end()
        shutil.rmtree(cluster.folder, ignore_errors=True)
    for i in range(1, SHARDS + 1):
        assert f"shard {i} of {SHARDS}" in told, told
    parts = [os.path.join("parts", f"shard-{i}") for i in range(1, SHARDS + 1)]
    assert campaign(sentree, work, "merge", *parts, "--out", "merged") == code
    for file in ("runs.csv", "result.json"):
        assert read(work, "merged", file) == read(work, "alone", file), f"{file} differs"
    print(f"✓ {SHARDS} tasks of a Slurm array give what one process gives, byte for byte")
    return 0


if __name__ == "__main__":
    sys.exit(main())
