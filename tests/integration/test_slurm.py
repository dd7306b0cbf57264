# SPDX-License-Identifier: Apache-2.0
"""Decompositions on a Slurm cluster of this machine, whose daemons are killed under them.

CARILLON_SLURM_BODIES says how many bodies (40 is the whole campaign), CARILLON_SEED repeats one.
Needs slurm-wlm and munge, and root; skipped where no cluster can be started with them.
"""

import os
import pathlib
import random
import shutil
import signal
import subprocess
import tempfile
import threading
import time
import unittest

import meshes
import scripted
import strike
from carillon.v1 import decomposition_pb2, decomposition_service_pb2, modal_model_pb2
from daemon import MATERIAL, ROOT, ScratchTest

BODY_COUNT = int(os.environ.get("CARILLON_SLURM_BODIES", "4"))
SEED = int(os.environ.get("CARILLON_SEED", "0")) or random.SystemRandom().getrandbits(32)
# The controller is killed so often, up to so long after a submit.
BATCH_COUNT, LATEST_KILL_S = (10, 10) if BODY_COUNT >= 40 else (2, 2)
SCRIPT = ROOT / "deploy/slurm/one_machine.sh"


class Cluster:
    def __init__(self, folder):
        self.folder = folder
        self.over = threading.Event()
        os.environ["SLURM_CONF"] = str(folder / "slurm.conf")

    def run(self, action, *more):
        return subprocess.run([SCRIPT, action, self.folder, *more], capture_output=True, check=False, timeout=120)

    def start(self):
        """Whether it works: a job that does nothing comes to its end."""
        try:
            if self.run("start", "1").returncode != 0:
                return False
            return subprocess.run(["srun", "--mem=10M", "true"], capture_output=True, timeout=60,
                                  check=False).returncode == 0
        except (OSError, subprocess.TimeoutExpired):
            return False

    def tend(self):
        """What an administrator does: a node is drained where a controller that forgot a job gave its number to
        another, and the first still ran there."""
        while not self.over.wait(1):
            for line in self.call("sinfo", "--noheader", "--format=%n %T"):
                node, state = line.split()
                if "drain" in state:
                    self.call("scontrol", "update", f"nodename={node}", "state=resume")

    @staticmethod
    def call(*command):
        """The lines that a command prints, none if the controller is down."""
        try:
            return subprocess.run(command, capture_output=True, text=True, timeout=20).stdout.splitlines()
        except subprocess.TimeoutExpired:
            return []

    def kill(self, program):
        """kill -9, and the program starts again."""
        pid_file = self.folder / {"slurmctld": "slurmctld.pid", "slurmd": "slurmd-node1.pid"}[program]
        try:
            os.kill(int(pid_file.read_text()), signal.SIGKILL)
        except (OSError, ValueError):
            return
        while self.run(program).returncode != 0:
            pass


class SlurmTest(ScratchTest):
    @classmethod
    def setUpClass(cls):
        for program in ("slurmctld", "slurmd", "munged"):
            if shutil.which(program, path="/usr/sbin:/usr/bin") is None:
                raise AssertionError(f"{program} is not installed: deploy/setup.sh tests")
        scratch = cls.enterClassContext(tempfile.TemporaryDirectory(prefix="carillon-slurm-"))
        cls.cluster = Cluster(pathlib.Path(scratch))
        cls.addClassCleanup(cls.cluster.run, "stop")
        if not cls.cluster.start():
            raise unittest.SkipTest("no Slurm cluster can be started here")
        tending = threading.Thread(target=cls.cluster.tend)
        tending.start()
        cls.addClassCleanup(tending.join)
        cls.addClassCleanup(cls.cluster.over.set)

    def setUp(self):
        # A controller that was killed may take jobs that have ended to run for ever.
        subprocess.run(["scancel", "--user", "root"], capture_output=True, timeout=60, check=False)
        super().setUp()
        self.rng = random.Random(SEED)

    def start_daemon(self, *arguments):
        self.serve("--slurm-dir", self.folder / "data/slurm", *arguments)

    def create(self, client, number):
        # Real bodies, each another: the number of nodes makes the name, and some 0.3 s of work.
        return client.create(
            meshes.bar(), "obj", material=MATERIAL,
            settings=modal_model_pb2.DecompositionSettings(
                mesh=modal_model_pb2.MeshSettings(target_node_count=200 + number)))

    def test_every_model_is_there_once_though_daemons_of_the_cluster_and_ours_are_killed(self):
        self.start_daemon()
        batches = [range(BODY_COUNT)[i::BATCH_COUNT] for i in range(BATCH_COUNT)]
        jobs = []
        for i, batch in enumerate(batches):
            jobs += [self.create(self.daemon.client(), number) for number in batch]
            time.sleep(self.rng.uniform(0, LATEST_KILL_S))  # when they die is the experiment
            self.cluster.kill("slurmctld")
            if i == 0:
                self.cluster.kill("slurmd")
            if i in (BATCH_COUNT // 2, BATCH_COUNT - 1):
                self.daemon.kill()
                self.daemon.start()
        client = self.daemon.client()
        for job in jobs:
            client.wait(job)
        self.assertEqual(self.daemon.stop(), 0)
        self.assertEqual(scripted.stored(self.folder), (BODY_COUNT, BODY_COUNT, 0))
        print(f"\nseed {SEED}: {BODY_COUNT} bodies, slurmctld killed {BATCH_COUNT} times, slurmd once, the daemon "
              f"twice: {BODY_COUNT} models stored once each")

    def test_verdicts_come_through_the_cluster(self):
        body = """
case $((nodes % 10)) in
  1) kill -SEGV $$ ;;
  2) x=0123456789abcdef; while :; do x=$x$x; done ;;
  *) sleep 1000 ;;
esac"""
        self.start_daemon("--precompute", scripted.worker(self.folder, body), "--job-memory-mib", 100)
        client = self.client
        for number, reason in ((1, "WORKER_CRASHED"), (2, "OUT_OF_MEMORY")):
            with self.assertRaises(strike.Refused) as refused:
                client.wait(self.create(client, number))
            self.assertEqual(refused.exception.info.reason, reason)
        endless = self.create(client, 3)
        client.jobs.CancelJob(decomposition_service_pb2.CancelJobRequest(name=endless.name))
        *_, last = client.jobs.WatchJob(decomposition_service_pb2.WatchJobRequest(name=endless.name))
        self.assertEqual(last.job.state, decomposition_pb2.JOB_STATE_CANCELLED)
