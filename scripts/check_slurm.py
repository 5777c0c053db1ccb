#!/usr/bin/env python3
"""Runs a small sweep under a real SLURM of one node, with a preemption and a time limit on the way.

    cargo build --release --bins && sudo python3 scripts/check_slurm.py

Needs root, and Debian's `slurm-wlm` and `munge`; if one of them is missing it says so and exits with 0. The cluster lives
in a temporary folder, listens on this machine only, and is removed afterwards. Checked for scripts/slurm:

- the array trains every run of the sweep, and the report follows it;
- a run that is cancelled saves itself and is not queued again;
- a run preempted by a job of higher priority, and one told that its time is up, save themselves, are queued again, and
  end with the same bytes as under the local pool.
"""

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SWEEP = """\
[run]
steps = 6000
evaluate_every = 2000
evaluation_episodes = 1
checkpoint_every = 100000
env.horizon = 100
learner = { hidden = [64, 64], random_steps = 1000 }

[[group]]
tasks = ["lift"]
spaces = ["aforce", "osc"]
seeds = [1, 2]
"""
CONFIGURATION = """\
ClusterName=check
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket,cred_expire=5
CredType=cred/munge
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
SlurmctldParameters=preempt_send_user_signal
ReturnToService=2
MpiDefault=none
SwitchType=switch/none
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory=4096 State=UNKNOWN
PartitionName=low Nodes=ALL Default=YES PriorityTier=1 GraceTime=60 State=UP
PartitionName=high Nodes=ALL PriorityTier=2 PreemptMode=OFF State=UP
"""


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(0)


def run(*command):
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()


def wait(what, condition, seconds=300):
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            sys.exit(f"FAILED: {what}: not within {seconds} s")
        time.sleep(0.2)
    print(f"ok: {what}", flush=True)


class Cluster:
    def __init__(self, folder):
        self.folder, self.daemons = folder, []

    def begin(self):
        folder = self.folder
        # Munge requires a folder that every user can reach.
        folder.chmod(0o755)
        (folder / "slurm.conf").write_text(CONFIGURATION.format(host=socket.gethostname().split(".")[0], folder=folder))
        (folder / "cgroup.conf").write_text("CgroupAutomount=no\n")
        key = folder / "munge.key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o400)
        os.environ["SLURM_CONF"] = str(folder / "slurm.conf")
        paths = {"key-file": key, "log-file": "munge.log", "pid-file": "munge.pid", "seed-file": "munge.seed", "socket": "munge.socket"}
        self.start("munged", "--foreground", "--force", *(f"--{name}={folder / path}" for name, path in paths.items()))
        wait("munged answers", lambda: (folder / "munge.socket").exists(), 20)
        self.start("slurmctld", "-D")
        self.start("slurmd", "-D")
        wait("the node is idle", lambda: "idle" in self.query("sinfo", "-h", "-o", "%T"), 60)

    def start(self, *command):
        log = open(self.folder / f"{command[0]}.out", "w")
        self.daemons.append(subprocess.Popen(command, stdout=log, stderr=log))

    def query(self, *command):
        return subprocess.run(command, capture_output=True, text=True).stdout

    def job(self, name):
        """What the controller knows of a job, as a dictionary; empty when it has forgotten it."""
        words = self.query("scontrol", "--oneliner", "show", "job", name).split()
        return dict(word.split("=", 1) for word in words if "=" in word)

    def stop(self):
        self.query("scancel", "--user=root")
        for daemon in reversed(self.daemons):
            daemon.terminate()
            daemon.wait(20)


def check(cluster, folder):
    sweep, out, local = folder / "sweep.toml", folder / "runs", folder / "local"
    sweep.write_text(SWEEP)
    run("target/release/sweep", sweep, "--out", local)

    words = run("scripts/slurm/submit.sh", sweep, out).replace(",", " ").split()
    print(" ".join(words))
    array, report = words[words.index("job") + 1], words[len(words) - 1 - words[::-1].index("job") + 1]
    task = "{}_{}".format
    learning = lambda path: (out / path / "progress.csv").exists()
    wait("two runs at once are learning", lambda: learning("lift/aforce/seed_1") and learning("lift/osc/seed_1"))

    # Both slots are taken: the job of higher priority preempts one run. The other run is told that its time is up.
    high = run("sbatch", "--parsable", "--partition=high", "--output=/dev/null", "--wrap", "sleep 2")
    restarted = lambda: [i for i in (0, 1) if cluster.job(task(array, i)).get("Restarts") == "1"]
    wait("one run is preempted and queued again", lambda: len(restarted()) == 1)
    wait("the job of higher priority is done", lambda: cluster.job(high).get("JobState") == "COMPLETED")
    other = 1 - restarted()[0]
    # scancel repeats a signal that the controller wrongly reports as not sent, so it is ended once the run is queued again.
    timer = subprocess.Popen(["scancel", "--batch", "--signal=TERM", task(array, other)])
    wait("the other is queued again when its time is up", lambda: len(restarted()) == 2)
    timer.kill()
    for i in (0, 1):
        log = next(out.glob(f"slurm-*_{i}.log")).read_text()
        assert "stopped; continue" in log, log
    wait("the report follows the last run", lambda: cluster.job(report).get("JobState") == "COMPLETED", 900)

    for i in range(4):
        assert cluster.job(task(array, i)).get("JobState") == "COMPLETED", i
    assert len((out / "runs.csv").read_text().splitlines()) == 5
    folders = sorted(path.parent.relative_to(local) for path in local.rglob("DONE"))
    assert len(folders) == 4
    for path in folders:
        for table in ("episodes.csv", "eval.csv"):
            assert (local / path / table).read_bytes() == (out / path / table).read_bytes(), path / table
    print("ok: four runs, the same bytes as under the local pool")
    assert "done" in subprocess.run(
        ["scripts/slurm/submit.sh", sweep, out], cwd=ROOT, capture_output=True, text=True
    ).stderr
    print("ok: nothing is submitted twice")

    other = folder / "cancelled"
    words = run("scripts/slurm/submit.sh", sweep, other, "--partition=low").replace(",", " ").split()
    array = words[words.index("job") + 1]
    wait("one more sweep is learning", lambda: (other / "lift/aforce/seed_1/progress.csv").exists())
    run("scancel", array)
    saved = lambda: all("stopped; continue" in log.read_text() for log in other.glob("slurm-*_*.log"))
    wait("what is cancelled saves itself", saved)
    time.sleep(5)  # By then a run would have been queued again.
    states = {cluster.job(task(array, i)).get("JobState") for i in (0, 1)}
    assert states == {"CANCELLED"}, states
    print("ok: what is cancelled is not queued again")


def main():
    missing = [name for name in ("munged", "slurmctld", "slurmd", "sbatch") if shutil.which(name) is None]
    if missing:
        skip(f"{', '.join(missing)} not found; Debian's packages are slurm-wlm and munge")
    if os.geteuid() != 0:
        skip("needs root, because it starts the daemons of a cluster")
    folder = Path(tempfile.mkdtemp(prefix="slurm-"))
    cluster = Cluster(folder)
    try:
        cluster.begin()
        check(cluster, folder)
    finally:
        cluster.stop()
    shutil.rmtree(folder)


main()
