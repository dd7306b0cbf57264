# SPDX-License-Identifier: Apache-2.0
"""What is rendered of one strike is what the modes say it must be."""

import math
import unittest

import numpy

import meshes
import sound
from carillon.v1 import (
    contact_pb2, contact_service_pb2, contact_trace_pb2, decomposition_service_pb2, material_pb2,
    modal_model_pb2, modal_model_service_pb2, scene_service_pb2)
from daemon import DaemonTest


def at_once(*impulses):
    return [contact_pb2.ContactStep(time_s=0, contacts=impulses)]


class StruckBody(DaemonTest):
    """A daemon with one body decomposed."""

    MESH = None
    SETTINGS = modal_model_pb2.DecompositionSettings()

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.model = cls.client.wait(cls.create())
        cls.eigenvalues = numpy.array(cls.client.models.GetModalModel(
            modal_model_service_pb2.GetModalModelRequest(name=cls.model)).modal_model.eigenvalues)

    @classmethod
    def create(cls):
        return cls.client.create(cls.MESH, "obj", settings=cls.SETTINGS,
                                 material=material_pb2.Material(preset=meshes.MATERIAL))

    def object(self, size=1.0, gain=1.0, **figures):
        material = material_pb2.Material(preset=meshes.MATERIAL, **figures)
        return contact_trace_pb2.ContactTraceObject(handle=1, modal_model=self.model,
                                                    material=material, size=size, gain=gain)

    def render(self, body, steps, tail_s):
        samples, summary = sound.render(self.daemon, [body], steps, tail_s)
        self.assertEqual(int(summary["rejected_count"]), 0)
        self.assertEqual(int(summary["limited_frame_count"]), 0)
        return samples

    def modes(self, young_pa=meshes.YOUNG_PA, density_kg_per_m3=meshes.DENSITY,
              alpha1_s=meshes.ALPHA1_S, alpha2_per_s=0.0, size=1.0):
        """(damped frequencies in Hz, decay rates in 1/s) of the model, as in docs/physics.md, 2."""
        scaled = self.eigenvalues * young_pa / (density_kg_per_m3 * size**2)
        sigma = -(alpha1_s * scaled + alpha2_per_s) / 2
        return numpy.sqrt(scaled - sigma**2) / (2 * math.pi), sigma


class BarTest(StruckBody):
    MESH = meshes.bar()
    # Off every symmetry, so that no mode stays silent; below the limiter, above the rounding of the file.
    POINT = (0.006, 0.0013, 0.010)
    IMPULSE = (0.0, 0.002, -0.005)

    def struck(self, tail_s=1.0, size=1.0, **figures):
        point = [size * x for x in self.POINT]
        return self.render(self.object(size=size, **figures),
                           at_once(sound.impulse(point, self.IMPULSE)), tail_s)

    def test_every_spectral_peak_is_a_mode(self):
        frequencies, _ = self.modes()
        peaks = sound.spectral_peaks_hz(self.struck(tail_s=2.0), floor_db=-50)
        self.assertGreaterEqual(len(peaks), 5)
        for peak in peaks:
            nearest = frequencies[numpy.argmin(numpy.abs(frequencies - peak))]
            self.assertLess(abs(peak - nearest), max(1.0, 0.001 * nearest))
        self.assertLess(abs(peaks[0] - frequencies[0]), max(1.0, 0.001 * frequencies[0]))

    def test_every_loud_mode_decays_as_its_sigma_says(self):
        # More damping than the preset's, so that every mode moves within the time measured.
        figures = {"alpha1_s": 2e-8, "alpha2_per_s": 12.0}
        frequencies, sigmas = self.modes(**figures)
        samples = self.struck(**figures)
        measured = 0
        for frequency, sigma in zip(frequencies, sigmas):
            apart = numpy.sort(numpy.abs(frequencies - frequency))[1]
            if frequency > 15000 or apart < 250:
                continue
            # Until it has decayed by 43 dB more: further down is the rounding of the file.
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
        partial = sound.measure(self.struck(size=size, **figures), frequencies[0], 0.06, 0.25)
        self.assertLess(abs(partial.frequency_hz - frequencies[0]), 0.5)
        self.assertLess(abs(partial.decay_per_s / sigmas[0] - 1), 0.02)
        return partial

    def test_no_change_of_material_or_size_decomposes_again(self):
        self.first_mode(young_pa=2e11, density_kg_per_m3=7800.0, size=0.5)
        jobs = self.client.jobs.ListJobs(decomposition_service_pb2.ListJobsRequest()).jobs
        self.assertEqual([job.modal_model for job in jobs], [self.model])

    def test_second_submit_computes_nothing(self):
        seen = []
        created = self.client.models.GetModalModel(
            modal_model_service_pb2.GetModalModelRequest(name=self.model)).modal_model
        self.assertEqual(self.client.wait(self.create(), seen.append), self.model)
        self.assertEqual(len(seen), 1)
        again = self.client.models.GetModalModel(
            modal_model_service_pb2.GetModalModelRequest(name=self.model)).modal_model
        self.assertEqual(again.created_unix_ms, created.created_unix_ms)

    def test_live_sounds_as_offline(self):
        steps = [contact_pb2.ContactStep(time_s=time, contacts=[sound.impulse(self.POINT, force)])
                 for time, force in ((0.0, self.IMPULSE), (0.13, (0.0, -0.0003, -0.0002)))]
        offline = self.render(self.object(), steps, 0.4)
        scene = self.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        self.client.scenes.AddObjects(scene_service_pb2.AddObjectsRequest(
            scene=scene,
            objects=[scene_service_pb2.NewObject(modal_model=self.model, handle=1,
                material=material_pb2.Material(preset=meshes.MATERIAL))]))
        request = contact_service_pb2.StreamContactsRequest
        start = contact_service_pb2.ContactStreamStart(scene=scene, step_s=0.01,
                                                       scheduling_delay_s=0.2)
        answers = []
        heard = self.client.listen(2.0, on_start=lambda: answers.extend(
            self.client.contacts.StreamContacts(
                iter([request(start=start)] + [request(steps=[step]) for step in steps]))))
        self.client.scenes.DeleteScene(scene_service_pb2.DeleteSceneRequest(name=scene))
        self.assertEqual((answers[-1].accepted_count, answers[-1].late_count), (2, 0))
        self.assertEqual((heard.sample_rate_hz, heard.lost_frame_count), (sound.RATE, 0))
        live = numpy.array(heard.samples[::heard.channel_count], dtype=float)
        count = int(0.5 * sound.RATE)
        matches = numpy.correlate(live, offline[:count], "valid")
        begin = int(numpy.argmax(matches))
        piece = live[begin:begin + count]
        # The live strike may fall between two frames, the offline one does not: half a frame is
        # 15 degrees of the first mode and more of the higher ones, which are 20 dB down.
        alike = matches[begin] / (numpy.linalg.norm(piece) * numpy.linalg.norm(offline[:count]))
        self.assertGreater(alike, 0.98)
        self.assertAlmostEqual(numpy.linalg.norm(piece) / numpy.linalg.norm(offline[:count]), 1,
                               delta=0.01)


class TubeTest(StruckBody):
    MESH = meshes.tube()
    SETTINGS = modal_model_pb2.DecompositionSettings(
        mesh=modal_model_pb2.MeshSettings(keep_surface=True))

    def test_loudness_does_not_depend_on_the_angle_of_the_strike(self):
        levels = []
        for i in range(24):
            angle = 2 * math.pi * (i + 0.3) / 24
            across = (math.cos(angle), math.sin(angle))
            point = (meshes.TUBE_RADIUS * across[0], meshes.TUBE_RADIUS * across[1], 0.04)
            force = (-0.001 * across[0], -0.001 * across[1], 0.0)
            # A wooden clapper's contact: the bending pairs are what is heard.
            samples = self.render(self.object(),
                                  at_once(sound.impulse(point, force, duration_s=0.0006)), 1.0)
            levels.append(sound.level_db(samples))
        self.assertLess(max(levels) - min(levels), 0.5)
        self.assertGreater(min(levels), -80)


if __name__ == "__main__":
    unittest.main()
