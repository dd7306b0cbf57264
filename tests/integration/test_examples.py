# SPDX-License-Identifier: Apache-2.0
"""The examples at reduced length: what deploy/examples.sh leaves, from every engine."""

import argparse
import json
import sys

import numpy

import carillon
from daemon import BUILD, ROOT, DaemonTest

sys.path.insert(0, str(ROOT / "client_sdk/examples/falls"))
import bunnies  # noqa: E402
import falls  # noqa: E402
import run  # noqa: E402
import scene_makers  # noqa: E402


class ExamplesTest(DaemonTest):
    def run_example(self, name, engine, seconds, rate=240, max_frequency=3000):
        options = argparse.Namespace(name=name, engine=engine, rate=rate, seconds=seconds, build=BUILD, video=False,
                                     max_frequency=max_frequency)
        sound = run.run(self.c, options, self.folder)
        for suffix in (".contacts", ".wav", "-spectrogram.png", "-spectrum.png"):
            self.assertGreater((self.folder / f"{name}-{engine}{suffix}").stat().st_size, 1000)
        self.assertGreater(sound.summary.findings.blow_count, 0)
        self.assertEqual(sound.samples.shape[1], 2)
        return sound

    def test_blocks_sound_from_every_engine(self):
        for engine in falls.ENGINES:
            with self.subTest(engine):
                summary = self.run_example("blocks", engine, 0.5).summary
                distant_count = sum(one.count for one in summary.warnings if one.id == "POINTS_DISTANT")
                # An engine lets a corner sink in now and then; points in a wrong frame would be far away throughout.
                self.assertLess(distant_count, 0.01 * summary.findings.load_count)

    def test_every_other_example_sounds(self):
        for name, engine, seconds in (("boxes", "ode", 0.5), ("letters", "mujoco", 0.8), ("bowl", "bullet", 0.4),
                                      ("wooden_bowl", "rapier", 0.4)):
            with self.subTest(name):
                self.run_example(name, engine, seconds)

    def test_each_bunny_and_each_shelf_sounds(self):
        # Meshing takes most of the time, so that a lower limit of frequency saves half of it.
        self.run_example("bunnies", "bullet", 2.6, rate=1000, max_frequency=3000)
        trace = carillon.Trace.read(self.folder / "bunnies-bullet.contacts")
        gains = [body.gain if body.HasField("gain") else 1 for body in trace.objects]
        peaks = []
        for alone in range(5):
            for number, body in enumerate(trace.objects):
                body.gain = gains[number] if number == alone else 0
            peaks.append(self.c.render(trace, sample_rate_hz=48000, tail_s=0.1).peak)
        print("peaks of the shelves and the bunnies:", *(f"{peak:.2g}" for peak in peaks), flush=True)
        self.assertGreater(min(peaks), 1e-3 * max(peaks))

    def test_chimes_sound_from_both_sides(self):
        sound = self.run_example("chimes", "bullet", 3)
        self.assertFalse(numpy.array_equal(sound.samples[:, 0], sound.samples[:, 1]))

    def test_every_engine_simulates_as_long_as_the_scene_says(self):
        scene = json.loads((falls.SCENES / "corner.json").read_text())
        scene["seconds"] = 0.25
        for engine in falls.ENGINES:
            trace = self.folder / f"{engine}.contacts"
            falls.record(engine, scene, trace, rate=240)
            self.assertEqual(len(carillon.Trace.read(trace).steps), 60, engine)
            falls.record(engine, scene, trace, rate=240, seconds=0.5)
            self.assertEqual(len(carillon.Trace.read(trace).steps), 120, engine)

    def test_a_bowl_rolls_on_its_rim_and_lies_still_on_it_in_rapier(self):
        """Rapier's own settings stopped the bowl after 0.7 s; then it rattled, and its impulses differed by 12 %."""
        scene = scene_makers.EXAMPLES["bowl"](self.folder)
        scene["bodies"][1]["model"] = "modalModels/not_rendered"
        for engine in ("bullet", "mujoco", "rapier"):
            trace = self.folder / f"bowl-{engine}.contacts"
            falls.record(engine, scene, trace, rate=240, seconds=3, build=BUILD)
            steps = carillon.Trace.read(trace).steps
            heights = [step.poses.position_m[2] for step in steps]
            # Its centre of mass is half its radius high when the bowl lies, and 73 mm high when it leans at first.
            self.assertGreater(min(heights[:240]), 1.5 * scene_makers.BOWL_RADIUS_M / 2, engine)
        loads = [sum(abs(row.impulse_newton_seconds.z) for row in step.contacts) for step in steps[-120:]]
        self.assertLess(numpy.std(loads), 0.001 * numpy.mean(loads))

    def test_a_shell_of_a_sphere_has_its_moments(self):
        area, centre, inertia = bunnies.as_shell(*map(numpy.array, falls.ball_mesh(1, 4)))
        numpy.testing.assert_allclose(area, 4 * numpy.pi, rtol=0.01)
        numpy.testing.assert_allclose(centre, 0, atol=1e-12)
        numpy.testing.assert_allclose(inertia, 2 / 3 * numpy.eye(3), atol=0.01)
