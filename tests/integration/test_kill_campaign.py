# SPDX-License-Identifier: Apache-2.0
"""kill -9 of the daemon, again and again, in the middle of writes and jobs.

CARILLON_KILLS says how often (200 is the whole campaign), CARILLON_SEED repeats one.
"""

import contextlib
import itertools
import os
import random
import sqlite3
import threading
import time

import grpc

import meshes
import scripted
from carillon.v1 import decomposition_pb2, decomposition_service_pb2, modal_model_pb2, modal_model_service_pb2
from daemon import MATERIAL, ScratchTest, wait_until

KILL_COUNT = int(os.environ.get("CARILLON_KILLS", "6"))
SEED = int(os.environ.get("CARILLON_SEED", "0")) or random.SystemRandom().getrandbits(32)

# Between 0 and 80 ms of work, then a model; what began and what ended is written down.
WORKER = """echo $nodes >>"$here/began"
sleep 0.0$((nodes % 9))
cp "$here/bar.model" "$out"
echo $nodes >>"$here/ended"
"""


class Writers:
    """Clients that import models and create jobs, as fast as they can, until the daemon is gone.
    `models` and `jobs` hold what has been acknowledged."""

    def __init__(self, records):
        self.records = records
        self.numbers = itertools.count(1)
        self.models, self.jobs = {}, {}
        self.begun_count = 0

    def run(self, daemon, duration_s, rng):
        """Writes until the daemon is killed under the writers' hands."""
        digest = daemon.client().upload(meshes.bar())
        clients = [threading.Thread(target=self._until_killed, args=(daemon.client(), work, digest))
                   for work in (self._import, self._import, self._create)]
        for client in clients:
            client.start()
        time.sleep(duration_s * rng.random())  # when it dies is the experiment
        daemon.kill()
        for client in clients:
            client.join()

    def _until_killed(self, client, work, mesh_digest):
        try:
            while True:
                work(client, mesh_digest)
        except grpc.RpcError as error:
            if error.code() not in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.CANCELLED):
                raise

    def records_of(self, number):
        """A model that is like no other."""
        first = modal_model_pb2.ModalModelRecord()
        first.CopyFrom(self.records[0])
        first.header.solver = f"campaign {number}"
        return [first, *self.records[1:]]

    def _import(self, client, _):
        number = next(self.numbers)
        name = f"modalModels/{number:064x}"
        self.begun_count += 1
        client.models.ImportModalModel(
            modal_model_service_pb2.ImportModalModelRequest(record=record, name=name)
            for record in self.records_of(number))
        self.models[name] = number

    def _create(self, client, mesh_digest):
        settings = modal_model_pb2.DecompositionSettings(
            mesh=modal_model_pb2.MeshSettings(target_node_count=next(self.numbers)))
        job = client.models.CreateModalModel(modal_model_service_pb2.CreateModalModelRequest(
            mesh_digest=mesh_digest, mesh_format="obj", material=MATERIAL, settings=settings)).job
        self.jobs[job.name] = job
        if job.state == decomposition_pb2.JOB_STATE_QUEUED:
            client.wait(job)


class KillCampaign(ScratchTest):
    def setUp(self):
        super().setUp()
        self.records = scripted.read_records(scripted.make_model(self.folder))
        self.rng = random.Random(SEED)

    def exported(self, client, name):
        """The records of a model; the daemon checks each hash on the way."""
        return [answer.record for answer in client.models.ExportModalModel(
            modal_model_service_pb2.ExportModalModelRequest(name=name))]

    def check_models(self, client, writers, known):
        """Every acknowledged model is there, and every model there, acknowledged or not, is whole."""
        listed = [model.name for model in client.list(page_size=1000)]
        self.assertEqual(len(listed), len(set(listed)))
        self.assertLessEqual(set(writers.models), set(listed))
        for name in set(listed) - known:
            records = self.exported(client, name)
            number = int(name.removeprefix("modalModels/"), 16)
            expected = writers.records_of(number) if number < 2**64 else self.records
            self.assertEqual(records, expected)
        known.update(listed)

    def lines(self, name):
        path = self.folder / name
        return path.read_text().split() if path.exists() else []

    def test_nothing_acknowledged_is_lost_or_partial_and_every_job_ends_once(self):
        self.serve("--precompute", scripted.worker(self.folder, WORKER))
        writers, known = Writers(self.records), set()
        for _ in range(KILL_COUNT):
            writers.run(self.daemon, 0.4, self.rng)
            wait_until(lambda: not scripted.processes_of(self.folder / "data"), 5)
            self.daemon.start()
            self.check_models(self.daemon.client(), writers, known)
        client = self.daemon.client()
        # A job whose submission was not acknowledged may run, too.
        submitted = client.jobs.ListJobs(decomposition_service_pb2.ListJobsRequest(page_size=1000)).jobs
        self.assertLessEqual(set(writers.jobs), {job.name for job in submitted})
        for job in submitted:
            client.wait(job)
        self.check_models(client, writers, known)
        self.assertEqual(self.daemon.stop(), 0)
        # Had a model been stored again, a revision would be missing.
        self.assertEqual(scripted.stored(self.folder), (len(known), len(known), 0))
        with contextlib.closing(sqlite3.connect(self.folder / "data/carillon.db")) as database:
            self.assertEqual(database.execute("PRAGMA integrity_check").fetchall(), [("ok",)])
        print(f"\nseed {SEED}: {KILL_COUNT} kills, {len(writers.models)} of {writers.begun_count} imports and "
              f"{len(writers.jobs)} jobs acknowledged, {len(known)} models whole; "
              f"{len(self.lines('began'))} runs begun, {len(self.lines('ended'))} ended")
