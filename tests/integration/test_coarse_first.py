# SPDX-License-Identifier: Apache-2.0
"""A coarse model sounds while the fine one is computed, and a kill in between costs neither."""

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
# The fine model waits until it may be computed.
WORKER = """
echo ${nodes:-all} >>"$here/runs"
[ -n "$nodes" ] || while [ ! -e "$here/enough" ]; do sleep 0.05; done
exec BIN/carillon-precompute "$@"
""".replace("BIN", str(BIN))


class CoarseFirstTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.daemon = Daemon(self.folder, "--precompute", scripted.worker(self.folder, WORKER))
        self.addCleanup(self.daemon.stop)
        self.client = self.daemon.client()

    def model(self, name):
        return self.client.models.GetModalModel(
            modal_model_service_pb2.GetModalModelRequest(name=name)).modal_model

    def await_coarse(self, job):
        """Returns once the coarse model is there and the fine one is being computed."""
        for response in self.client.jobs.WatchJob(decomposition_service_pb2.WatchJobRequest(name=job.name)):
            if response.job.coarse_ready and response.job.state == decomposition_pb2.JOB_STATE_RUNNING:
                return

    def assert_sounds(self, name):
        scene = self.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        handle = self.client.scenes.AddObjects(scene_service_pb2.AddObjectsRequest(
            scene=scene, objects=[scene_service_pb2.NewObject(modal_model=name, material=MATERIAL)])).objects[0].handle
        heard = self.client.listen(0.5, lambda: self.client.strike(
            scene, [sound.impulse((0, 0, 0), (0, 1, 0), handle=handle)]))
        self.assertGreater(numpy.abs(heard.samples).max(), 0)

    def test_the_coarse_model_sounds_until_the_fine_one_is_there_through_a_kill(self):
        job = self.client.create(meshes.bar(), "obj", material=MATERIAL, coarse_first=True)
        self.await_coarse(job)
        coarse = self.model(job.modal_model)
        self.assertEqual(coarse.header.settings.mesh.target_node_count, 300)
        self.assert_sounds(job.modal_model)

        self.daemon.kill()
        self.daemon.start()
        self.client = self.daemon.client()
        self.assert_sounds(job.modal_model)
        (self.folder / "enough").touch()
        self.assertEqual(self.client.wait(job), job.modal_model)
        fine = self.model(job.modal_model)
        self.assertGreater(fine.revision, coarse.revision)
        self.assertGreater(fine.header.node_count, coarse.header.node_count)
        # Near the same pitch: few nodes are a little too stiff.
        self.assertGreater(coarse.eigenvalues[0], fine.eigenvalues[0])
        self.assertLess(coarse.eigenvalues[0], 1.1 * fine.eigenvalues[0])
        self.assert_sounds(job.modal_model)
        self.assertEqual((self.folder / "runs").read_text().split(), ["300", "all", "all"])


if __name__ == "__main__":
    unittest.main()
