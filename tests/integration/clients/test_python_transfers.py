# SPDX-License-Identifier: Apache-2.0
"""The clients in Python and Node wait for a model's transfer, and warn of a sound that comes before it."""

import asyncio
import pathlib
import subprocess
import warnings

import numpy

import carillon
import meshes
import scripted
from daemon import ScratchTest, node_environment

BAR = meshes.box(meshes.BAR_SIZE)
STRIKE = {"point": (0.0, 0.008, 0.010), "impulse": (0, 0, -0.002), "duration": 1e-4, "seconds": 0.2}


class TransfersTest(ScratchTest):
    def setUp(self):
        super().setUp()
        self.serve("--transfers", "--precompute", scripted.worker(self.folder, scripted.TRANSFERS_WAIT))
        self.c = self.enterContext(carillon.connect(self.daemon.server))

    def make(self, **request):
        return self.c.create_model(BAR, meshes.MATERIAL, label="bar", max_frequency_hz=3000,
                                   transfer={"accuracy_db": 6}, **request)

    def allow(self):
        (self.folder / "enough").touch()

    def test_a_rendering_before_the_transfer_warns_and_one_after_it_does_not(self):
        bar = self.make()
        with self.assertWarnsRegex(carillon.TransferWarning, r"^bar \(transfer\) is still being computed") as told:
            before = bar.render_strike(**STRIKE)
        self.assertEqual(told.filename, __file__)
        with self.assert_refused("DEADLINE_EXCEEDED", "bar (transfer) is running and has not ended after"):
            bar.wait_for_transfer(0.2)
        states = []
        self.allow()
        bar.wait_for_transfer(60, progress_bar=lambda job: states.append(job.label))
        self.assertEqual(set(states), {"bar (transfer)"})
        self.assertEqual(len(bar.summary.transfers), 1)
        bar.wait_for_transfer(0)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            after = bar.render_strike(**STRIKE)
            numpy.testing.assert_array_equal(bar.render_strike(**STRIKE).samples, after.samples)
        self.assertGreater(abs(after.peak / before.peak - 1), 0.1)

    def test_a_scene_warns_once_of_a_model_whose_transfer_it_lacks_and_the_sound_changes_when_it_comes(self):
        bar = self.make()
        impulse = {key: STRIKE[key] for key in ("point", "impulse", "duration")}
        with self.c.scene() as scene:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                scene.add(bar, radiation="paper_coupling").remove()
            with self.assertWarnsRegex(carillon.TransferWarning, r"^bar \(transfer\) is still being computed, so that "
                                       r"the objects sound by the paper's coupling, at other levels, until they change "
                                       r"to it; call wait_for_transfer\(\)") as told:
                objects = scene.add_all([bar, {"model": bar}])
            self.assertEqual((told.filename, len(told.warnings)), (__file__, 1))
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                scene.add(bar)
                before = self.heard(scene, objects[0], impulse)
                self.allow()
                bar.wait_for_transfer(300)
                after = self.heard(scene, objects[1], impulse)
                scene.add(bar)
        self.assertGreater(abs(after / before - 1), 0.1)

    def heard(self, scene, item, strike):
        with self.c.recording(scene=scene.name) as record:
            item.strike(**strike)
            return record.take(0.3).peak

    def test_a_model_without_a_transfer_keeps_nobody_waiting(self):
        bar = self.make(without_transfer=True)
        bar.wait_for_transfer(0)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            self.assertEqual(bar.render_strike(**STRIKE).summary.paper_coupling_object_count, 1)

    def test_a_transfer_that_was_cancelled_is_told(self):
        bar = self.make()
        next(job for job in self.c.jobs() if job.is_transfer).cancel()
        with self.assert_refused("JOB_CANCELLED", "was cancelled"):
            bar.wait_for_transfer(60)

    def test_a_transfer_that_fails_is_told(self):
        (self.folder / "fail").touch()
        bar = self.make()
        self.allow()
        for _ in range(2):  # While it is computed, and after.
            with self.assertRaises(carillon.CarillonError) as refused:
                bar.wait_for_transfer(60)
            self.assertNotEqual(refused.exception.reason, "DEADLINE_EXCEEDED")

    def test_a_task_of_asyncio_waits_and_may_be_cancelled(self):
        self.make()

        async def wait():
            async with carillon.aio.connect(self.daemon.server) as c:
                bar = await c.model("bar")
                with self.assertRaises(asyncio.TimeoutError):
                    await asyncio.wait_for(bar.wait_for_transfer(), 0.3)
                self.allow()
                await bar.wait_for_transfer(60)
                return bar.summary.transfers

        self.assertEqual(len(asyncio.run(wait())), 1)

    def test_a_program_in_node_waits_and_is_warned(self):
        name = self.make().name
        done = subprocess.run(
            ["node", pathlib.Path(__file__).with_name("wait_for_transfer.js"), name, self.folder / "enough"],
            env={**node_environment(self.folder), "CARILLON_SERVER": self.daemon.server}, check=False,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.assertEqual(done.returncode, 0, done.stdout)
