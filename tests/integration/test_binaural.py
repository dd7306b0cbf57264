# SPDX-License-Identifier: Apache-2.0
"""Scenes that are heard by two ears, from traces and live."""

import numpy

import carillon
import meshes
from carillon.v1 import hearing_pb2
from daemon import DaemonTest

HEARING = hearing_pb2.Hearing(binaural=True)
STRIKE = carillon.Impacts(objects=[1], points=[(0, 0.008, 0.01)], impulses=[(0, 0, -0.002)], durations=[1e-4])


def levels_db(sound):
    """Of the left and of the right channel, with that of the whole."""
    left, right = (10 * numpy.log10(numpy.mean(numpy.square(sound.samples[:, i], dtype="f8"))) for i in (0, 1))
    return left, right, numpy.logaddexp(left / 4.343, right / 4.343) * 4.343


class BinauralTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.model = cls.c.create_model(meshes.box(meshes.BAR_SIZE), meshes.MATERIAL)

    def heard_from(self, place, hearing=HEARING, **settings):
        trace = carillon.Trace(1 / 240, hearing=hearing)
        trace.add(self.model, pose=(place, (1, 0, 0, 0)))
        trace.step(0.1, impacts=STRIKE)
        return self.c.render(trace, channel_count=2, tail_s=0.5, **settings)

    def test_each_ear_hears_its_own_side_louder(self):
        for place in ((1, 0, 0), (0.7, 0.2, -0.7), (1, 0, 0.3)):
            left, right, _ = levels_db(self.heard_from(place))
            self.assertGreater(right, left + 3, place)
            mirrored_left, mirrored_right, _ = levels_db(self.heard_from((-place[0], *place[1:])))
            self.assertGreater(mirrored_left, mirrored_right + 3, place)

    def test_behind_and_above_sound_unlike_ahead(self):
        ahead, behind, above = (self.heard_from(place).samples for place in ((0, 0, -1), (0, 0, 1), (0, 1, 0)))
        for other in (behind, above):
            self.assertGreater(numpy.abs(other - ahead).max(), 0.05 * numpy.abs(ahead).max())

    def test_a_live_scene_is_made_and_says_what_it_is(self):
        with self.c.scene(hearing=HEARING) as scene:
            scene.add(self.model, pose=((1, 0, 0), (1, 0, 0, 0)))
        self.assertIn("binaural", self.c.info().features)
