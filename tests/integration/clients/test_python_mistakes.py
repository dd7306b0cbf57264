# SPDX-License-Identifier: Apache-2.0
"""Mistakes of a caller of the Python package that would otherwise stay silent."""

import subprocess
import sys
import time

import numpy

import carillon
from test_python_package import IMPULSE, POINT, PackageTest


class MistakesTest(PackageTest):

    def test_a_stream_that_is_not_closed_is_told_at_the_end_of_the_program(self):
        script = ("import carillon, time\n"
                  f"c = carillon.connect({self.c.server!r})\n"
                  "scene = c.scene()\n"
                  f"bar = scene.add({self.model.name!r})\n"
                  "stream = scene.stream(step=1 / 240)\n"
                  "for i in range(160):\n"
                  "    stream.step(i / 240, contacts=carillon.Contacts(bar, [(90, 0, 0)], [(0, 0, -1e-3)]))\n"
                  "    time.sleep(1 / 240)\n")
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60)
        self.assertIn("ContactWarning: STREAM_NOT_CLOSED: ", done.stderr)
        self.assertIn("ContactWarning: POINTS_DISTANT: ", done.stderr)

    def test_mistakes_that_were_silent_are_refused(self):
        trace = carillon.Trace(step=1 / 240)
        trace.add(self.model)
        with self.c.scene() as scene:
            bar = scene.add(self.model)
            for objects in (bar, [bar]):
                with self.assertRaisesRegex(ValueError, "which is not in the trace; give what Trace.add returned"):
                    trace.step(0, impacts=carillon.Impacts(objects, [(0, 0, 0)], [(0, 0, -1e-3)]))
        for step_s in (-1, 4.17, 1e-9, float("nan")):
            wrong = carillon.Trace(step=step_s)
            wrong.step(0, impacts=carillon.Impacts(wrong.add(self.model), [(0, 0, 0)], [(0, 0, -1e-3)]))
            with self.assertRaisesRegex(carillon.CarillonError, "step_s is .*; say the simulator's step, from 1e-6"):
                self.c.render(wrong)
        with self.assertRaisesRegex(ValueError, r"must end with \.wav"):
            carillon.Sound(numpy.zeros((1, 1)), 48000, 0).save(self.folder / "x.mp3")
        with self.assertRaisesRegex(ValueError, "seconds is -1; it must be more than 0"):
            self.c.listen(-1)
        for address in ("/run/carillond.sock", "http://localhost:1"):
            with self.assertRaisesRegex(ValueError, '"unix:PATH" or "HOST:PORT"'):
                carillon.connect(address)


class SceneThatEndsTooEarlyTest(PackageTest):
    """Has a daemon of its own, which must be silent before."""

    def test_an_accepted_impulse_sounds_only_if_its_scene_lasts_until_it_is_due(self):
        for waits in (False, True):
            with self.c.recording() as record:
                with self.c.scene() as scene:
                    with scene.stream(step=0.001, delay=1) as stream:
                        stream.step(0, impacts=carillon.Impacts(scene.add(self.model), [POINT], [IMPULSE]))
                    self.assertEqual((stream.report.accepted_count, stream.findings.blow_count), (1, 0))
                    if waits:  # as docs/ten_minutes_python.md says
                        time.sleep(stream.report.ahead_s + 0.1)
                        self.assertGreater(scene.get().active_mode_count, 0)
                        while scene.get().active_mode_count:
                            time.sleep(0.1)
                self.assertEqual(record.take(2).peak > 0, waits)  # it is due after 1 s
