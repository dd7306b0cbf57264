# SPDX-License-Identifier: Apache-2.0
"""One collision sounds alike from five engines; a contact beneath a corner sounds as one at the corner."""

import json
import statistics
import sys
import unittest

import numpy

import carillon
from daemon import ROOT, DaemonTest

sys.path.insert(0, str(ROOT / "client_sdk/examples/falls"))
import falls  # noqa: E402
import video  # noqa: E402

LIMIT_DB = 3


def energy_db(sound):
    return 10 * numpy.log10(numpy.sum(numpy.square(sound.mono)))


class FallsTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.carillon = carillon.connect(cls.daemon.server)
        cls.addClassCleanup(cls.carillon.close)
        scene = json.loads((falls.SCENES / "collision.json").read_text())
        cls.scene = falls.create_models(cls.carillon, scene)

    def test_the_same_collision_is_as_loud_from_every_engine(self):
        levels = {}
        for engine in falls.ENGINES:
            trace = self.folder / f"{engine}.contacts"
            falls.record(engine, self.scene, trace, rate=1000, seconds=0.3)
            sound = self.render(trace)
            self.assertEqual(sound.summary.limited_frame_count, 0)
            self.assertGreater(sound.summary.findings.blow_count, 0)
            levels[engine] = energy_db(sound)
        median = statistics.median(levels.values())
        print({engine: round(level - median, 1) for engine, level in levels.items()}, flush=True)
        for engine, level in levels.items():
            self.assertLess(abs(level - median), LIMIT_DB, engine)

    def test_a_video_shows_the_bodies_where_the_simulation_has_them(self):
        trace = self.folder / "seen.contacts"
        falls.record("bullet", self.scene, trace, rate=1000, seconds=0.3)
        frames = video.frames_of(self.scene, carillon.Trace.read(trace).steps)
        self.assertAlmostEqual(len(frames), 0.3 * video.FRAMES_PER_S, delta=1)
        ways = [numpy.linalg.norm(numpy.subtract(last[0], first[0])) for first, last in zip(frames[0], frames[-1])]
        self.assertGreater(max(ways), 0.01)

    def render(self, path):
        """Softly, so that nothing is limited."""
        trace = carillon.Trace.read(path)
        for body in trace.objects:
            body.gain = 0.001
        return self.carillon.render(trace, sample_rate_hz=48000, tail_s=0.3)

    def strike(self, at):
        """A contact of a cube's corner, as an engine reports it at a place on the way to its middle."""
        trace = carillon.Trace(step=1 / 240)
        cube = trace.add(self.scene["bodies"][0]["model"], "concrete", gain=0.001)
        for step in range(20):
            contacts = carillon.Contacts(cube, [(at, at, at)], [(-0.3, -0.3, -0.3)]) if step == 2 else None
            trace.step(step / 240, contacts=contacts)
        return self.carillon.render(trace, sample_rate_hz=48000, tail_s=0.3)

    def test_a_contact_beneath_a_corner_sounds_as_one_at_the_corner(self):
        numpy.testing.assert_array_equal(self.strike(0.096).samples, self.strike(0.1).samples)


if __name__ == "__main__":
    unittest.main()
