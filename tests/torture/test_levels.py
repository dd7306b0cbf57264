# SPDX-License-Identifier: Apache-2.0
"""One object does not silence the others for long, however hard it is struck."""

import numpy

import carillon
import meshes
import sound
from daemon import DaemonTest

# Rings for some milliseconds, so that the limiter alone is seen.
DULL = carillon.material(young_pa=meshes.YOUNG_PA, density_kg_per_m3=meshes.DENSITY, poisson_ratio=0.329801,
                         alpha1_s=meshes.ALPHA1_S, alpha2_per_s=400)
TIP = (0.0, 0.0, meshes.BAR_SIZE[2])
SECONDS, PERIOD_S = 6.0, 0.05
BEGIN = 20  # the period in which the rogue is struck first
WINDOW = 2048
SILENT_DB = -40
MOST_SILENT_S = 0.5


class LevelTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.model = cls.c.create_model(meshes.box(meshes.BAR_SIZE), meshes.MATERIAL)
        cls.frequency_hz = (cls.model.eigenvalues[0] * meshes.YOUNG_PA / meshes.DENSITY)**0.5 / (2 * numpy.pi)

    def heard(self, material=None, rogue_blows=()):
        """The quiet bar's first mode over time, in windows, beside a rogue that is struck in these periods."""
        trace = carillon.Trace()
        trace.add(self.model)
        if material is not None:
            trace.add(self.model, material, size=0.617, gain=1000)
        for period in range(int(SECONDS / PERIOD_S)):
            rows = 2 if period in rogue_blows else 1
            blows = carillon.Impacts([1, 2][:rows], [TIP] * rows, [(0, 0, -1e-4), (0, 0, -1000)][:rows],
                                     durations=[0, 1e-4][:rows])
            trace.step(period * PERIOD_S, impacts=blows)
        samples = self.c.render(trace, sample_rate_hz=sound.RATE).samples[:, 0]
        count = len(samples) // WINDOW
        shift = numpy.exp(-2j * numpy.pi * self.frequency_hz * numpy.arange(WINDOW) / sound.RATE)
        windows = samples[:count * WINDOW].reshape(count, WINDOW)
        return numpy.abs(windows @ (shift * numpy.blackman(WINDOW)))

    def assert_heard_beside(self, material, rogue_blows):
        """For no more than a moment the quiet bar is lower by 40 dB than alone."""
        alone = self.heard()
        lower = self.heard(material, rogue_blows)
        # A render ends once its sound is far below its own peak, which a loud rogue raises.
        count = min(len(alone), len(lower))
        self.assertGreater(count * WINDOW / sound.RATE, SECONDS)
        lower = lower[:count] / alone[:count]
        silent_s = numpy.count_nonzero(20 * numpy.log10(lower + 1e-30) < SILENT_DB) * WINDOW / sound.RATE
        print(f"{self.id().rsplit('.', 1)[-1]}: others below {SILENT_DB} dB for {silent_s:.2f} s", flush=True)
        self.assertLess(silent_s, MOST_SILENT_S)

    def test_the_largest_blow_on_a_dull_object(self):
        self.assert_heard_beside(DULL, [BEGIN])

    def test_the_largest_blow_again_and_again(self):
        self.assert_heard_beside(DULL, range(BEGIN, BEGIN + 60))

    def test_the_largest_blow_on_an_object_that_rings(self):
        self.assert_heard_beside(meshes.MATERIAL, [BEGIN])
