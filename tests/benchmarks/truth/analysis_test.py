# SPDX-License-Identifier: Apache-2.0
"""A synthetic recording of known modes must come back; the catalogue as Python reads it, and the page printed from it;
and fields at microphones against closed forms of monopoles and dipoles."""

import math
import types
import unittest

import numpy

import catalogue
import likeness
import materials
import microphone
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


class CatalogueTest(unittest.TestCase):
    def test_a_constant_loss_factor_gives_decays_in_proportion_to_frequency(self):
        porcelain = catalogue.read()["porcelain"]
        self.assertAlmostEqual(porcelain.decay_per_s(1000), 4.3e-4 * math.pi * 1000)
        self.assertAlmostEqual(porcelain.decay_per_s(8000), 8 * porcelain.decay_per_s(1000))

    def test_a_table_is_straight_in_the_logarithms(self):
        acrylic = catalogue.read()["acrylic"]
        self.assertAlmostEqual(acrylic.loss_factor_at(1000), math.sqrt(0.04 * 0.02))
        self.assertEqual(acrylic.loss_factor_at(20), 0.04)
        self.assertEqual(acrylic.loss_factor_at(20000), 0.02)

    def test_the_papers_materials_keep_their_rayleigh_damping(self):
        bowl = catalogue.read()["bowl_metal"]
        omega = 2 * math.pi * 500
        self.assertAlmostEqual(bowl.decay_per_s(500), (1e-7 * omega**2 + 30) / 2)

    def test_the_page_has_the_tables_of_today(self):
        text = materials.PAGE.read_text()
        self.assertEqual(text, materials.page_with_tables(text), "run tests/benchmarks/truth/materials.py --write")


HEADER = types.SimpleNamespace(sound_speed_m_per_s=343, air_density_kg_per_m3=1.204)
LOSSLESS = types.SimpleNamespace(decay_per_s=lambda hz: 3.0)
HZ = (2000.0, 5000.0)


def transfer(indices):
    """One harmonic for each mode of HZ, of the power integral 1e-6."""
    wavenumbers = numpy.array([2 * math.pi * hz / 343 for hz in HZ])
    return HEADER, {
        "eigenvalues": numpy.array([(2 * math.pi * hz)**2 for hz in HZ]), "states": numpy.array([1, 1]),
        "power_integrals": numpy.array([1e-6, 1e-6]), "first": numpy.array([0, 1, 2]),
        "harmonics": numpy.array(indices), "coefficients": numpy.stack([1e-3 * wavenumbers, 0 * wavenumbers], axis=1)}


class MicrophoneTest(unittest.TestCase):
    def test_harmonics_of_first_order_are_the_axes(self):
        polar, azimuth = 0.7, 0.4
        axes = (math.sin(polar) * math.sin(azimuth), math.cos(polar), math.sin(polar) * math.cos(azimuth))
        for index, axis in zip((1, 2, 3), axes):
            self.assertAlmostEqual(microphone.harmonics(index, polar, azimuth), math.sqrt(3 / (4 * math.pi)) * axis)

    def test_harmonics_are_orthonormal(self):
        z, weights = numpy.polynomial.legendre.leggauss(8)
        azimuth = 2 * math.pi * numpy.arange(16) / 16
        values = numpy.array([microphone.harmonics(index, numpy.arccos(z)[:, None], azimuth).ravel()
                              for index in range(25)])
        solid_angles = numpy.repeat(weights * 2 * math.pi / 16, 16)
        numpy.testing.assert_allclose(values * solid_angles @ values.T, numpy.eye(25), atol=1e-12)

    def test_a_monopole_falls_with_the_distance_alone(self):
        around = microphone.Microphones(transfer([0, 0]), LOSSLESS, 1.0, 1.0)
        numpy.testing.assert_allclose(abs(around.fields), 1 / numpy.tile(around.places[:, 0], (2, 1)))

    def test_a_dipole_is_silent_across_and_stronger_near_by(self):
        around = microphone.Microphones(transfer([2, 2]), LOSSLESS, 1.0, 1.0)
        distance, polar, _ = around.places.T
        x = around.wavenumbers[:, None] * distance
        numpy.testing.assert_allclose(abs(around.fields), math.sqrt(3) * abs(numpy.cos(polar)) / distance
                                      * numpy.sqrt(1 + 1 / x**2), atol=1e-12)

    def test_each_mode_gets_its_own_strength(self):
        around = microphone.Microphones(transfer([0, 2]), LOSSLESS, 1.0, 1.0)
        time = numpy.arange(4800) / rings.RATE_HZ
        sound = sum(numpy.exp(-3 * time) * numpy.cos(2 * math.pi * hz * time) for hz in HZ)
        heard = {tuple(place): samples for place, samples in around.hear(sound)}
        distance, _, azimuth = max(heard)
        across = rings.ring_near(heard[distance, math.pi / 2, azimuth], HZ[0])
        self.assertAlmostEqual(across.amplitude, 1 / distance, delta=0.03 / distance)
        self.assertIsNone(rings.ring_near(heard[distance, math.pi / 2, azimuth], HZ[1]))
