# SPDX-License-Identifier: Apache-2.0
"""What is rendered of one strike is what the modes say it must be."""

import math

import numpy

import carillon
import meshes
import sound
from daemon import DaemonTest


class StruckBody(DaemonTest):
    """A daemon with one body decomposed."""

    EXAMPLE = None  # of the command line; else the bar of the tests
    SETTINGS = None

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        (cls.folder / "body.obj").write_bytes(meshes.bar())
        if cls.EXAMPLE:
            cls.daemon.command("example", cls.EXAMPLE, "--out", cls.folder / "body.obj")
        cls.model = cls.c.create_model(cls.folder / "body.obj", meshes.MATERIAL, settings=cls.SETTINGS)

    def struck(self, point, impulse, duration_s, seconds, size=1.0, **figures):
        """The samples of one strike at time zero, which the limiter leaves as they are."""
        heard = self.model.render_strike(point, impulse, carillon.material(meshes.MATERIAL, **figures), size=size,
                                         duration=duration_s, seconds=seconds)
        self.assertEqual(heard.summary.limited_frame_count, 0)
        return heard.samples[:, 0]

    def modes(self, young_pa=meshes.YOUNG_PA, density_kg_per_m3=meshes.DENSITY,
              alpha1_s=meshes.ALPHA1_S, alpha2_per_s=0.0, size=1.0):
        """(damped frequencies in Hz, decay rates in 1/s) of the model, as in docs/physics.md, 2."""
        scaled = self.model.eigenvalues * young_pa / (density_kg_per_m3 * size**2)
        sigma = -(alpha1_s * scaled + alpha2_per_s) / 2
        return numpy.sqrt(scaled - sigma**2) / (2 * math.pi), sigma


class BarTest(StruckBody):
    # Off every symmetry, so that no mode stays silent; below the limiter.
    POINT = (0.006, 0.0013, 0.010)
    IMPULSE = (0.0, 0.002, -0.005)

    def struck_bar(self, seconds=1.0, size=1.0, **figures):
        return self.struck([size * x for x in self.POINT], self.IMPULSE, 0, seconds, size, **figures)

    def test_every_spectral_peak_is_a_mode(self):
        frequencies, _ = self.modes()
        peaks = sound.spectral_peaks_hz(self.struck_bar(seconds=2.0), floor_db=-50)
        self.assertGreaterEqual(len(peaks), 5)
        for peak in peaks:
            nearest = frequencies[numpy.argmin(numpy.abs(frequencies - peak))]
            self.assertLess(abs(peak - nearest), max(1.0, 0.001 * nearest))
        self.assertLess(abs(peaks[0] - frequencies[0]), max(1.0, 0.001 * frequencies[0]))

    def test_every_loud_mode_decays_as_its_sigma_says(self):
        # More damping than the preset's, so that every mode moves within the time measured.
        figures = {"alpha1_s": 2e-8, "alpha2_per_s": 12.0}
        frequencies, sigmas = self.modes(**figures)
        samples = self.struck_bar(**figures)
        measured = 0
        for frequency, sigma in zip(frequencies, sigmas):
            apart = numpy.sort(numpy.abs(frequencies - frequency))[1]
            if frequency > 15000 or apart < 250:
                continue
            # Until it has decayed by 43 dB more.
            end_s = 0.025 + min(0.24, 5 / abs(sigma))
            partial = sound.measure(samples, frequency, 0.025, end_s, smoothing_s=0.004)
            if partial.amplitude < 1e-3 * samples.max():
                continue  # Beside it the skirts of the loud ones count.
            self.assertLess(abs(partial.frequency_hz - frequency), max(1.0, 0.001 * frequency))
            self.assertLess(abs(partial.decay_per_s / sigma - 1), 0.02, f"{frequency} Hz")
            measured += 1
        self.assertGreaterEqual(measured, 5)

    def first_mode(self, size=1.0, **figures):
        """The first mode as it sounds, with enough damping to measure it."""
        figures.setdefault("alpha2_per_s", 20.0)
        frequencies, sigmas = self.modes(size=size, **figures)
        partial = sound.measure(self.struck_bar(size=size, **figures), frequencies[0], 0.06, 0.25)
        self.assertLess(abs(partial.frequency_hz - frequencies[0]), 0.5)
        self.assertLess(abs(partial.decay_per_s / sigmas[0] - 1), 0.02)
        return partial

    def test_no_change_of_material_or_size_decomposes_again(self):
        self.first_mode(young_pa=2e11, density_kg_per_m3=7800.0, size=0.5)
        self.assertEqual([job.message.modal_model for job in self.c.jobs()], [self.model.name])


class TubeTest(StruckBody):
    EXAMPLE, RADIUS_M = "chime", 0.0125
    SETTINGS = {"mesh": {"keep_surface": True}}

    def test_loudness_does_not_depend_on_the_angle_of_the_strike(self):
        levels = []
        for i in range(24):
            angle = 2 * math.pi * (i + 0.3) / 24
            across = (math.cos(angle), math.sin(angle))
            point = (self.RADIUS_M * across[0], self.RADIUS_M * across[1], 0.04)
            force = (-0.001 * across[0], -0.001 * across[1], 0.0)
            # A wooden clapper's contact: the bending pairs are what is heard.
            levels.append(sound.level_db(self.struck(point, force, 0.0006, 1.0)))
        self.assertLess(max(levels) - min(levels), 0.5)
        self.assertGreater(min(levels), -80)
