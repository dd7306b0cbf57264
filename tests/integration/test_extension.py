# SPDX-License-Identifier: Apache-2.0
"""A model is asked for again with a higher limit: it comes under the same name, and the old one sounds meanwhile."""

import pathlib
import tempfile
import unittest

import numpy

import meshes
import scripted
import sound
from carillon.v1 import (decomposition_pb2, decomposition_service_pb2, material_pb2, modal_model_service_pb2,
                         scene_service_pb2)
from daemon import BIN, Daemon

MATERIAL = material_pb2.Material(preset=meshes.MATERIAL)
# What asks for the whole band waits until it may.
WORKER = """
[ "$max_frequency_hz" != 20000 ] || while [ ! -e "$here/enough" ]; do sleep 0.05; done
exec BIN/carillon-precompute "$@"
""".replace("BIN", str(BIN))


class ExtensionTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.daemon = Daemon(self.folder, "--precompute", scripted.worker(self.folder, WORKER))
        self.addCleanup(self.daemon.stop)
        self.client = self.daemon.client()
        self.scene = self.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name

    def create(self, max_frequency_hz):
        return self.client.create(meshes.bar(), "obj", material=MATERIAL, max_frequency_hz=max_frequency_hz)

    def model(self, name):
        return self.client.models.GetModalModel(
            modal_model_service_pb2.GetModalModelRequest(name=name)).modal_model

    def add(self, model):
        return self.client.scenes.AddObjects(scene_service_pb2.AddObjectsRequest(
            scene=self.scene, objects=[scene_service_pb2.NewObject(modal_model=model, material=MATERIAL)])).objects[0]

    def assert_sounds(self, handle):
        """A strike of the object is taken, and something is heard."""
        heard = self.client.listen(0.5, lambda: self.client.strike(
            self.scene, [sound.impulse((0, 0, 0), (0, 1, 0), handle=handle)]))
        self.assertGreater(numpy.abs(heard.samples).max(), 0)

    def test_the_old_revision_sounds_until_and_after_the_new_one_is_there(self):
        name = self.client.wait(self.create(5000))
        before, old = self.model(name), self.add(name)
        job = self.create(20000)
        self.assertEqual(job.modal_model, name)
        now = self.client.jobs.GetJob(decomposition_service_pb2.GetJobRequest(name=job.name)).job
        self.assertIn(now.state, (decomposition_pb2.JOB_STATE_QUEUED, decomposition_pb2.JOB_STATE_RUNNING))
        self.assert_sounds(old.handle)
        self.assertEqual(self.add(name).sounding_mode_count, old.sounding_mode_count)

        (self.folder / "enough").touch()
        self.assertEqual(self.client.wait(job), name)
        after, new = self.model(name), self.add(name)
        self.assertGreater(after.revision, before.revision)
        self.assertGreater(after.header.complete_to_eigenvalue, before.header.complete_to_eigenvalue)
        self.assertGreater(new.sounding_mode_count, old.sounding_mode_count)
        # The same mesh, so the same modes, each to the accuracy that every model is verified to.
        known = before.eigenvalues
        numpy.testing.assert_allclose(after.eigenvalues[:len(known)], known, rtol=1e-6)
        self.assert_sounds(old.handle)
        self.assert_sounds(new.handle)


if __name__ == "__main__":
    unittest.main()
