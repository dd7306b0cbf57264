# SPDX-License-Identifier: Apache-2.0
"""The Python package against the real daemon: what it is, scenes with ids, all jobs, and what a rendering tells."""

import asyncio
import unittest

import numpy

import carillon
import meshes
from daemon import DaemonTest

BAR = meshes.box(meshes.BAR_SIZE)
POINT, IMPULSE, DURATION_S = (0.0, 0.008, 0.010), (0, 0, -0.002), 1e-4


class CallsTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.c = carillon.connect(cls.daemon.server)
        cls.addClassCleanup(cls.c.close)
        cls.model = cls.c.create_model(BAR, meshes.MATERIAL, label="bar")

    def test_the_daemon_says_what_it_is(self):
        async def ask():
            async with carillon.aio.connect(self.daemon.server) as c:
                return await c.info()

        info, later = self.c.info(), asyncio.run(ask())
        self.assertEqual((info.version, info.limits), (carillon.__version__, later.limits))
        self.assertGreater(later.uptime_s, info.uptime_s)
        self.assertIn("decomposition", info.features)
        self.assertEqual(info.sample_rate_hz, self.c.status().format.sample_rate_hz)

    def test_a_gltf_brings_the_file_with_its_data(self):
        file = meshes.gltf_with_buffer(meshes.BAR_SIZE, self.folder)
        model = self.c.create_model(file, meshes.MATERIAL)
        self.assertEqual(model.mode_count, self.model.mode_count)
        file.write_text(file.read_text().replace("box.bin", "../box.bin"))
        with self.assertRaises(carillon.CarillonError) as raised:
            self.c.create_model(file, meshes.MATERIAL)
        self.assertEqual(raised.exception.reason, "MESH_UNREADABLE")

    def test_a_scene_with_an_id_is_found_again_with_its_objects(self):
        made = self.c.scene(id="lathe-1", gain=0.5)
        self.assertEqual((made.name, made.existing), ("scenes/lathe-1", False))
        made.add_all([self.model, {"model": self.model, "handle": 7, "gain": 2}])
        with self.assertRaises(carillon.CarillonError) as raised:
            made.add_all([self.model, {"model": self.model, "handle": 7}])
        self.assertEqual((raised.exception.reason, raised.exception.metadata["index"]), ("OBJECT_EXISTS", "1"))
        # Another connection, as after a loss of this one.
        with carillon.connect(self.daemon.server) as other, other.scene(id="lathe-1", gain=0.5) as again:
            self.assertTrue(again.existing)
            self.assertEqual([item.handle for item in again.objects()], [1, 7])
            self.assertEqual((again.get().object_count, again.get().gain), (2, 0.5))
            with self.assertRaises(carillon.CarillonError) as raised:
                other.scene(id="lathe-1")
            self.assertEqual(raised.exception.reason, "SCENE_DIFFERS")
        with self.assertRaises(carillon.CarillonError) as raised:
            made.get()
        self.assertEqual(raised.exception.reason, "SCENE_NOT_FOUND")

    def test_jobs_are_watched_and_filtered(self):
        changes = self.c.watch_jobs(label_contains="watched")
        self.assertIsNone(next(changes))
        size = 1.01 * numpy.array(meshes.BAR_SIZE)
        self.c.create_job(meshes.box(size), meshes.MATERIAL, label="Watched bar", without_transfer=True)
        states = []
        while not states or states[-1] != "succeeded":
            states.append(next(changes).state)
        changes.close()
        self.assertEqual(states, sorted(states, key=["queued", "running", "succeeded"].index))
        self.assertEqual([job.message.label for job in self.c.jobs(["succeeded"], "WATCHED")], ["Watched bar"])
        self.assertEqual(list(self.c.jobs(["failed"])), [])

        async def watch():
            async with carillon.aio.connect(self.daemon.server) as c:
                self.assertEqual([job.state async for job in c.jobs(label_contains="watched")], ["succeeded"])
                async for job in c.watch_jobs(states=["queued"]):
                    return job

        self.assertIsNone(asyncio.run(watch()))

    def test_a_rendering_tells_its_blows(self):
        trace = carillon.Trace(1 / 60)
        bar = trace.add(self.model)
        trace.step(0.25, impulses=carillon.Impulses(bar, POINT, IMPULSE, durations=DURATION_S))
        self.assertEqual(self.c.render(trace, tail_s=0.1).blows, ())
        blow, = self.c.render(trace, tail_s=0.1, tell_blows=True).blows
        self.assertAlmostEqual(blow.time_s, 0.25)
        self.assertAlmostEqual(blow.duration_s, DURATION_S)

    def test_a_soft_sound_is_normalised_with_its_tail(self):
        sounds = []
        for factor in (1, 1e-5):
            trace = carillon.Trace(1 / 60)
            bar = trace.add(self.model)
            trace.step(0.0, impulses=carillon.Impulses(bar, POINT, numpy.multiply(IMPULSE, factor),
                                                       durations=DURATION_S))
            sounds.append(self.c.render(trace, normalize=True, tail_s=0.3))
        numpy.testing.assert_allclose(sounds[1].samples, sounds[0].samples, atol=1e-4)

    def test_no_transfer_means_no_decay_by_radiation(self):
        numpy.testing.assert_array_equal(self.model.radiation_decays(), numpy.zeros(self.model.mode_count))


if __name__ == "__main__":
    unittest.main()
