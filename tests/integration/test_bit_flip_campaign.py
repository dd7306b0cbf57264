# SPDX-License-Identifier: Apache-2.0
"""Random bits of stored models flip on the disk, one after the other.

CARILLON_FLIPS says how many (1000 is the whole campaign), CARILLON_SEED repeats one.
"""

import os
import pathlib
import random
import sqlite3
import tempfile
import unittest

import grpc

import meshes
import scripted
from carillon.v1 import decomposition_service_pb2, material_pb2, modal_model_pb2
from carillon.v1 import modal_model_service_pb2
from daemon import Daemon

FLIP_COUNT = int(os.environ.get("CARILLON_FLIPS", "25"))
SEED = int(os.environ.get("CARILLON_SEED", "0")) or random.SystemRandom().getrandbits(32)
MATERIAL = material_pb2.Material(preset=meshes.MATERIAL)
MODEL_COUNT = 5


class BitFlipCampaign(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.records = scripted.read_records(scripted.make_model(self.folder))
        self.daemon = Daemon(self.folder, "--precompute", scripted.worker(
            self.folder, 'echo >>"$here/runs"; cp "$here/bar.model" "$out"'))
        self.addCleanup(self.daemon.stop)
        self.client = self.daemon.client()
        self.rng = random.Random(SEED)

    def create(self, node_count):
        settings = modal_model_pb2.DecompositionSettings(
            mesh=modal_model_pb2.MeshSettings(target_node_count=node_count))
        return self.client.create(meshes.bar(), "obj", material=MATERIAL, settings=settings)

    def wait(self, model):
        name = model.replace("modalModels/", "jobs/")
        return self.client.wait(self.client.jobs.GetJob(
            decomposition_service_pb2.GetJobRequest(name=name)).job)

    def flip(self, database, model):
        """One bit, each of the header's and the arrays' as likely as any other."""
        digest = model.removeprefix("modalModels/")
        blobs = [("models", "header", *row) for row in database.execute(
            "SELECT revision, length(header) FROM models WHERE digest = ?", (digest,))]
        blobs += [("model_chunks", "data", *row) for row in database.execute(
            "SELECT model_chunks.rowid, length(data) FROM model_chunks JOIN models USING (revision) "
            "WHERE digest = ?", (digest,))]
        table, column, row, size = self.rng.choices(blobs, weights=[b[3] for b in blobs])[0]
        data, = database.execute(f"SELECT {column} FROM {table} WHERE rowid = ?", (row,)).fetchone()
        data = bytearray(data)
        data[self.rng.randrange(size)] ^= 1 << self.rng.randrange(8)
        database.execute(f"UPDATE {table} SET {column} = ? WHERE rowid = ?", (bytes(data), row))

    def exported(self, model):
        return [answer.record for answer in self.client.models.ExportModalModel(
            modal_model_service_pb2.ExportModalModelRequest(name=model))]

    def test_every_flip_is_found_quarantined_logged_and_the_model_computed_again(self):
        models = [self.client.wait(self.create(count + 1)) for count in range(MODEL_COUNT)]
        database = sqlite3.connect(self.folder / "data/carillon.db", isolation_level=None, timeout=60)
        self.addCleanup(database.close)
        found = 0
        for _ in range(FLIP_COUNT):
            model = self.rng.choice(models)
            self.flip(database, model)
            with self.assertRaises(grpc.RpcError) as refused:
                self.exported(model)
            found += refused.exception.code() == grpc.StatusCode.DATA_LOSS
            self.assertIn("MODAL_MODEL_CORRUPT", refused.exception.details())
            self.wait(model)
            self.assertEqual(self.exported(model), self.records)
        self.assertEqual(found, FLIP_COUNT)
        log = (self.folder / "log").read_text()
        logged = log.count("the model is computed again")
        self.assertEqual(logged, FLIP_COUNT)
        runs = len((self.folder / "runs").read_text().splitlines())
        self.assertEqual(runs, MODEL_COUNT + FLIP_COUNT)
        print(f"\nseed {SEED}: {FLIP_COUNT} bits flipped, {found} found, {logged} logged, "
              f"{runs - MODEL_COUNT} models computed again")

    def test_a_bit_flipped_in_an_intent_does_not_keep_the_daemon_from_starting(self):
        job = self.create(77)
        self.client.wait(job)
        self.assertEqual(self.daemon.stop(), 0)
        database = sqlite3.connect(self.folder / "data/carillon.db", isolation_level=None)
        # 5 is cancelled: a job that nobody would look at again.
        database.execute("UPDATE jobs SET state = 5")
        database.close()
        self.daemon.start()
        self.client = self.daemon.client()
        damaged = self.client.jobs.GetJob(decomposition_service_pb2.GetJobRequest(name=job.name)).job
        self.assertEqual(damaged.error.reason, "DATABASE_CORRUPT")
        self.assertIn("has changed on the disk", (self.folder / "log").read_text())
        self.client.wait(self.create(77))


if __name__ == "__main__":
    unittest.main()
