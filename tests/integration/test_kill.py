# SPDX-License-Identifier: Apache-2.0
"""What the daemon has acknowledged survives kill -9."""

import unittest

import meshes
from carillon.v1 import contact_pb2, decomposition_pb2, decomposition_service_pb2, material_pb2
from carillon.v1 import scene_service_pb2
from daemon import DaemonTest

MATERIAL = material_pb2.Material(preset=meshes.MATERIAL)


class KillTest(DaemonTest):
    def restart(self):
        self.daemon.kill()
        self.daemon.start()
        type(self).client = self.daemon.client()

    def peak_of_a_strike(self, model):
        scene = self.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        handle = self.client.scenes.AddObjects(scene_service_pb2.AddObjectsRequest(
            scene=scene, objects=[scene_service_pb2.NewObject(modal_model=model, material=MATERIAL)])).objects[0].handle
        impulse = contact_pb2.Contact(
            kind=contact_pb2.CONTACT_KIND_IMPACT, object=handle, point_m=contact_pb2.Vec3(z=meshes.BAR_SIZE[2]),
            impulse_newton_seconds=contact_pb2.Vec3(z=-0.001))
        heard = self.client.listen(0.5, on_start=lambda: self.client.strike(scene, [impulse]))
        return max(map(abs, heard.samples))

    def test_model_is_there_after_a_kill_and_sounds_at_once(self):
        model = self.client.wait(self.client.create(meshes.bar(), "obj", material=MATERIAL))
        self.restart()
        listed = self.daemon.command("model", "list").stdout
        self.assertIn(model.removeprefix("modalModels/")[:12], listed)
        self.assertGreater(self.peak_of_a_strike(model), 1e-5)

    def test_job_acknowledged_before_a_kill_is_computed_after_it(self):
        # Another ratio makes it another model than the one above.
        material = material_pb2.Material(preset=meshes.MATERIAL, poisson_ratio=0.25)
        job = self.client.create(meshes.bar(), "obj", material=material)
        self.restart()
        self.assertIn(job.name, [known.name for known in self.client.jobs.ListJobs(
            decomposition_service_pb2.ListJobsRequest()).jobs])
        model = self.client.wait(job)
        self.assertEqual(model, job.modal_model)
        self.assertEqual(self.client.jobs.GetJob(decomposition_service_pb2.GetJobRequest(
            name=job.name)).job.state, decomposition_pb2.JOB_STATE_SUCCEEDED)


if __name__ == "__main__":
    unittest.main()
