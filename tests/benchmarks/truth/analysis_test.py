# SPDX-License-Identifier: Apache-2.0
"""A synthetic recording of known modes must come back."""

import math
import unittest

import numpy

import likeness
import rings

RATE_HZ = rings.RATE_HZ


def ringing(modes, seconds=0.37, noise=0.0):
    """Modes as (Hz, decay rate, amplitude), and white noise."""
    time = numpy.arange(int(seconds * RATE_HZ)) / RATE_HZ
    sound = sum(a * numpy.exp(-d * time) * numpy.cos(2 * numpy.pi * hz * time + phase)
                for phase, (hz, d, a) in enumerate(modes))
    return sound + noise * numpy.random.default_rng(1).standard_normal(len(time))


# As the recorded bar: a pair 140 Hz apart, of which one dies nine times as fast.
BAR = [(1279.3, 0.5, 0.02), (6879.8, 18.9, 0.12), (7020.4, 1.86, 0.056), (10946.5, 12.1, 0.043), (11306.4, 20.5, 0.038),
       (15349.9, 23.6, 0.18), (16719.3, 40.0, 0.05)]


class RingsTest(unittest.TestCase):
    def test_known_modes_come_back(self):
        sound = ringing(BAR, noise=1e-4)
        for hz, decay, amplitude in BAR:
            ring = rings.ring_near(sound, hz + 2)
            self.assertAlmostEqual(ring.hz, hz, delta=0.3)
            self.assertAlmostEqual(ring.decay_per_s, decay, delta=max(0.15, 0.05 * decay))
            self.assertAlmostEqual(ring.amplitude, amplitude, delta=0.1 * amplitude)

    def test_noise_holds_no_modes(self):
        noise = 0.01 * numpy.random.default_rng(2).standard_normal(RATE_HZ // 3)
        self.assertTrue(all(rings.ring_near(noise, hz) is None for hz, _, _ in BAR))

    def test_a_mode_below_the_noise_is_not_found(self):
        self.assertIsNone(rings.ring_near(ringing([(5000, 10, 1e-4)], noise=0.1), 5000))


class LikenessTest(unittest.TestCase):
    def test_a_sound_is_no_distance_from_itself_at_any_level(self):
        sound = ringing(BAR)
        self.assertAlmostEqual(likeness.mrstft(sound, 0.1 * sound), 0)
        self.assertAlmostEqual(likeness.octave_error_db(sound, 3 * sound, RATE_HZ), 0)

    def test_a_meter_shows_a_tone_of_one_pascal_at_94_db_and_hums_19_db_lower(self):
        time = numpy.arange(2 * RATE_HZ) / RATE_HZ
        for hz, db in ((1000, 94.0), (100, 94.0 - 19.1)):
            tone = math.sqrt(2) * numpy.sin(2 * math.pi * hz * time)
            self.assertAlmostEqual(likeness.fast_level_db(tone, RATE_HZ), db, delta=0.2)

    def test_the_distance_grows_with_what_is_wrong(self):
        right = ringing(BAR, noise=1e-4)
        dull = ringing([(hz, d, a if hz < 8000 else 0) for hz, d, a in BAR], noise=1e-4)
        short = ringing([(hz, 5 * d, a) for hz, d, a in BAR], noise=1e-4)
        both = ringing([(hz, 5 * d, a if hz < 8000 else 0) for hz, d, a in BAR], noise=1e-4)
        distances = [likeness.mrstft(right, sound) for sound in (dull, short, both)]
        self.assertGreater(min(distances[:2]), 0.1)
        self.assertGreater(distances[2], max(distances[:2]))

    def test_octaves_hold_the_power_of_their_modes(self):
        sound = ringing([(1000, 1, 1), (4000, 1, 0.1)])
        one, _, four, _, _ = likeness.octave_levels_db(sound, RATE_HZ)
        self.assertAlmostEqual(one - four, 20, delta=0.1)
