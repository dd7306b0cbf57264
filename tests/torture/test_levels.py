# SPDX-License-Identifier: Apache-2.0
"""One object does not silence the others for long, however hard it is struck."""

import unittest

import numpy

import meshes
import sound
from carillon.v1 import contact_pb2, contact_trace_pb2, material_pb2, modal_model_service_pb2
from daemon import DaemonTest

MATERIAL = material_pb2.Material(preset=meshes.MATERIAL)
# Rings for some milliseconds, so that the limiter alone is seen.
DULL = material_pb2.Material(young_pa=meshes.YOUNG_PA, density_kg_per_m3=meshes.DENSITY, poisson_ratio=0.329801,
                             alpha1_s=meshes.ALPHA1_S, alpha2_per_s=400)
SECONDS, BEGIN_S, PERIOD_S = 6.0, 1.0, 0.05
WINDOW = 2048
SILENT_DB = -40
MOST_SILENT_S = 0.5


class LevelTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.model = cls.client.wait(cls.client.create(meshes.bar(), "obj", material=MATERIAL))
        found = cls.client.models.GetModalModel(modal_model_service_pb2.GetModalModelRequest(name=cls.model))
        eigenvalue = found.modal_model.eigenvalues[0]
        cls.frequency_hz = (eigenvalue * meshes.YOUNG_PA / meshes.DENSITY)**0.5 / (2 * numpy.pi)

    def heard(self, rogue, blows):
        """The quiet bar's first mode over time, in windows. `blows`: (time, impulse) on the rogue."""
        objects = [contact_trace_pb2.ContactTraceObject(handle=1, modal_model=self.model, material=MATERIAL)]
        if rogue is not None:
            objects.append(rogue)
        tip = (0.0, 0.0, meshes.BAR_SIZE[2])
        times = {round(i * PERIOD_S, 3): [] for i in range(int(SECONDS / PERIOD_S))}
        for time_s, newton_seconds in blows:
            times[time_s].append(sound.impulse(tip, (0, 0, -newton_seconds), handle=2, duration_s=1e-4))
        steps = [contact_pb2.ContactStep(time_s=time_s, contacts=[sound.impulse(tip, (0, 0, -1e-4)), *rogues])
                 for time_s, rogues in sorted(times.items())]
        samples, summary = sound.render(self.daemon, objects, steps, 0)
        self.assertEqual(int(summary.get("rejectedCount", 0)), 0, summary)
        count = len(samples) // WINDOW
        shift = numpy.exp(-2j * numpy.pi * self.frequency_hz * numpy.arange(WINDOW) / sound.RATE)
        windows = samples[:count * WINDOW].reshape(count, WINDOW)
        return numpy.abs(windows @ (shift * numpy.blackman(WINDOW)))

    def silent_s(self, rogue, blows):
        """For how long the quiet bar is lower by 40 dB than alone."""
        alone = self.heard(None, [])
        lower = self.heard(rogue, blows)
        # A render ends once its sound is far below its own peak, which a loud rogue raises.
        count = min(len(alone), len(lower))
        self.assertGreater(count * WINDOW / sound.RATE, SECONDS)
        lower = lower[:count] / alone[:count]
        silent_s = numpy.count_nonzero(20 * numpy.log10(lower + 1e-30) < SILENT_DB) * WINDOW / sound.RATE
        print(f"{self.id().rsplit('.', 1)[-1]}: others below {SILENT_DB} dB for {silent_s:.2f} s", flush=True)
        return silent_s

    def rogue(self, material, gain):
        return contact_trace_pb2.ContactTraceObject(handle=2, modal_model=self.model, material=material,
                                                    size=0.617, gain=gain)

    def test_the_largest_blow_on_a_dull_object(self):
        self.assertLess(self.silent_s(self.rogue(DULL, 1000), [(BEGIN_S, 1000)]), MOST_SILENT_S)

    def test_the_largest_blow_again_and_again(self):
        blows = [(round(BEGIN_S + i * PERIOD_S, 3), 1000) for i in range(60)]
        self.assertLess(self.silent_s(self.rogue(DULL, 1000), blows), MOST_SILENT_S)

    def test_the_largest_blow_on_an_object_that_rings(self):
        self.assertLess(self.silent_s(self.rogue(MATERIAL, 1000), [(BEGIN_S, 1000)]), MOST_SILENT_S)


if __name__ == "__main__":
    unittest.main()
