# SPDX-License-Identifier: Apache-2.0
"""Contacts as Bullet and ODE report them, a resting load in every step, do not drone; a slide and a roll
are heard."""

import json
import sys
import unittest

import numpy

import carillon
import meshes
import sound
from carillon.v1 import contact_pb2, contact_trace_pb2, material_pb2, modal_model_pb2
from daemon import ROOT, DaemonTest

sys.path.insert(0, str(ROOT / "client_sdk/examples/falls"))
import falls  # noqa: E402

MATERIAL = "oak"
BOX_M = (0.20, 0.14, 0.03)  # its origin in the middle
MASS_KG = 2
RATES_HZ = (60, 240, 1000)
FLOOR = {"name": "floor", "shape": {"plane": {}}}


def box_on_floor(model, drop_m, friction, velocity_m_per_s=(0, 0, 0)):
    """A fall (docs/decisions/0042) of a box onto a rough floor."""
    return {"friction": friction, "restitution": 0.3, "roughness_depth": 0.3, "irregularity_length_m": 0.001,
            "bodies": [FLOOR, {"name": "box", "shape": {"boxes": [{"sides_m": BOX_M}]}, "mass_kg": MASS_KG,
                               "inertia_kg_m2": falls.box_inertia(MASS_KG, BOX_M),
                               "position_m": [0, 0, BOX_M[2] / 2 + drop_m], "velocity_m_per_s": velocity_m_per_s,
                               "model": model, "material": MATERIAL}]}


def centred_box():
    return meshes.obj(*meshes.box(BOX_M, low=[-side / 2 for side in BOX_M]))


def decibels(ratio):
    return 20 * numpy.log10(ratio + 1e-30)


def rms(samples):
    return numpy.sqrt(numpy.mean(numpy.square(samples)))


class RestTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.model = cls.decompose(centred_box(), MATERIAL)

    @classmethod
    def decompose(cls, mesh, material):
        return cls.client.wait(cls.client.create(
            mesh, "obj", settings=modal_model_pb2.DecompositionSettings(),
            material=material_pb2.Material(preset=material)))

    def render(self, trace):
        out = self.folder / "sound.wav"
        printed = self.daemon.command("--json", "render", trace, "--out", out, "--sample-rate",
                                      sound.RATE, "--tail", 1)
        self.assertEqual(int(json.loads(printed.stdout).get("rejected_count", 0)), 0)
        return sound.read_wave(out)[:, 0]

    def simulate(self, engine, scene, rate_hz, seconds):
        trace = self.folder / "floor.contacts"
        falls.record(engine, scene, trace, rate=rate_hz, seconds=seconds)
        return self.render(trace)

    @staticmethod
    def between(samples, begin_s, end_s):
        return samples[int(begin_s * sound.RATE):int(end_s * sound.RATE)]

    def assert_quiet(self, samples, begin_s, end_s, limit_db):
        quiet = numpy.abs(self.between(samples, begin_s, end_s)).max()
        level = decibels(quiet / numpy.abs(samples).max())
        print(f"{self.id().rsplit('.')[-1]}: {level:.1f} dB", flush=True)
        self.assertLess(level, limit_db)

    def constant_load(self, rate_hz):
        """A blow, and then the weight of 2 kg from two seconds on."""
        steps = [contact_pb2.ContactStep(time_s=0, contacts=[
            sound.impulse((0.03, 0.02, -0.015), (0, 0, 2), duration_s=0.0005)])]
        place = contact_pb2.Vec3(x=0.03, y=0.02, z=-0.015)
        for step in range(2 * rate_hz, 5 * rate_hz):
            force = contact_pb2.Contact(kind=contact_pb2.CONTACT_KIND_FORCE, object=1, point_m=place,
                                        force_newtons=contact_pb2.Vec3(z=19.62))
            steps.append(contact_pb2.ContactStep(time_s=step / rate_hz, contacts=[force]))
        trace = self.folder / "load.contacts"
        body = contact_trace_pb2.ContactTraceObject(
            handle=1, modal_model=self.model, material=material_pb2.Material(preset=MATERIAL))
        sound.write_trace(trace, [body], steps, step_s=1 / rate_hz)
        return self.render(trace)

    def test_a_constant_load_is_silent(self):
        for rate_hz in RATES_HZ:
            with self.subTest(rate_hz=rate_hz):
                self.assert_quiet(self.constant_load(rate_hz), 2.5, 4.9, -80)

    def test_a_box_at_rest_in_an_engine_is_silent(self):
        for engine in ("bullet", "ode"):
            for rate_hz in RATES_HZ:
                with self.subTest(engine=engine, rate_hz=rate_hz):
                    samples = self.simulate(engine, box_on_floor(self.model, 0.05, 0.5), rate_hz, 5)
                    self.assert_quiet(samples, 2.5, 4.9, -60)

    def test_the_same_box_sliding_is_heard_until_it_stops(self):
        for engine in ("bullet", "ode"):
            with self.subTest(engine=engine):
                # By Coulomb's law it slides for 1 / (0.05 * 9.81) = 2 s.
                samples = self.simulate(engine, box_on_floor(self.model, 0.05, 0.05, (1, 0, 0)), 240, 5)
                slides = rms(self.between(samples, 0.8, 1.5))
                rests = rms(self.between(samples, 4.5, 4.9))
                level = decibels(slides / numpy.abs(samples).max())
                print(f"slides in {engine}: {level:.1f} dB of the impact's peak", flush=True)
                # The box lands on four corners at once, whose blow is loud.
                self.assertGreater(level, -60)
                self.assertLess(decibels(rests / slides), -40)

    def test_a_rolling_ball_is_heard_without_lines_at_the_step_rate(self):
        with carillon.connect(self.daemon.server) as client:
            scene = falls.create_models(client, json.loads((falls.SCENES / "roll.json").read_text()))
        for engine in ("bullet", "ode"):
            with self.subTest(engine=engine):
                rolls = self.between(self.simulate(engine, scene, 240, 1.4), 0.3, 1.3)
                self.assertGreater(rms(rolls), 1e-5)
                self.assert_no_lines(rolls, 240)

    def assert_no_lines(self, samples, rate_hz):
        excess = sound.lines_db(samples, rate_hz)
        print(f"lines at the step rate: {excess:.1f} dB over what is beside them", flush=True)
        self.assertLess(excess, 3)


if __name__ == "__main__":
    unittest.main()
