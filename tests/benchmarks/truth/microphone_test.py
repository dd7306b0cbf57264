# SPDX-License-Identifier: Apache-2.0
"""Fields at microphones against closed forms of monopoles and dipoles."""

import math
import types
import unittest

import numpy

import microphone
import rings

HEADER = types.SimpleNamespace(sound_speed_m_per_s=343, air_density_kg_per_m3=1.204)
LOSSLESS = types.SimpleNamespace(decay_per_s=lambda hz: 3.0)
HZ = (2000.0, 5000.0)


def transfer(indices):
    """One harmonic for each mode of HZ, of the power integral 1e-6."""
    wavenumbers = numpy.array([2 * math.pi * hz / 343 for hz in HZ])
    return microphone.Transfer(HEADER, {
        "eigenvalues": numpy.array([(2 * math.pi * hz)**2 for hz in HZ]), "states": numpy.array([1, 1]),
        "power_integrals": numpy.array([1e-6, 1e-6]), "first": numpy.array([0, 1, 2]),
        "harmonics": numpy.array(indices), "coefficients": numpy.stack([1e-3 * wavenumbers, 0 * wavenumbers], axis=1)})


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
