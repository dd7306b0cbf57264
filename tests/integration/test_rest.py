# SPDX-License-Identifier: Apache-2.0
"""Contacts as engines report them: a resting load in every step does not drone, a slide and a roll are heard, also
without lines at the multiples of the step rate where they are reported unevenly, one collision sounds alike from five
engines, and a contact beneath a corner sounds as one at the corner."""

import json
import statistics
import sys

import numpy

import carillon
import meshes
import sound
from daemon import ROOT, DaemonTest

sys.path.insert(0, str(ROOT / "client_sdk/examples/falls"))
import falls  # noqa: E402
import video  # noqa: E402

MATERIAL = "oak"
BOX_M = (0.20, 0.14, 0.03)  # its origin in the middle
MASS_KG = 2
RATES_HZ = (60, 240, 1000)
FLOOR = {"name": "floor", "shape": {"plane": {}}}
# A slide whose contacts an engine reports unevenly.
SECONDS = 3
WEIGHT_N, FRICTION, SPEED_M_PER_S = 19.62, 0.3, 0.5
CORNERS = [(x * BOX_M[0] / 2, y * BOX_M[1] / 2, -BOX_M[2] / 2) for x in (-1, 1) for y in (-1, 1)]
# Its lowest mode is so low that the steps of 1000 Hz lie far above it.
BOARD_M = (0.4, 0.3, 0.008)
LIMIT_DB, CLICKS_DB = 2, -110


def box_on_floor(model, drop_m, friction, velocity_m_per_s=(0, 0, 0)):
    """A fall (docs/decisions/0042) of a box onto a rough floor."""
    return {"friction": friction, "restitution": 0.3, "roughness_depth": 0.3, "irregularity_length_m": 0.001,
            "bodies": [FLOOR, {"name": "box", "shape": {"boxes": [{"sides_m": BOX_M}]}, "mass_kg": MASS_KG,
                               "inertia_kg_m2": falls.box_inertia(MASS_KG, BOX_M),
                               "position_m": [0, 0, BOX_M[2] / 2 + drop_m], "velocity_m_per_s": velocity_m_per_s,
                               "model": model, "material": MATERIAL}]}


def decibels(ratio):
    return 20 * numpy.log10(ratio + 1e-30)


def rms(samples):
    return numpy.sqrt(numpy.mean(numpy.square(samples)))


def jittering(rng, count):
    """The force of each step fluctuates, and is spread anew over two to four corners."""
    for _ in range(count):
        shares = numpy.where(rng.permutation(4) < rng.integers(2, 5), rng.random(4), 0)
        yield WEIGHT_N * max(1 + 0.3 * rng.standard_normal(), 0) * shares / shares.sum()


def hopping(rng, count, gaps):
    """The body leaves the floor for some of `gaps` steps by turns, and then gets the impulse of all of them on one
    corner."""
    since, until = 0, rng.choice(gaps)
    for _ in range(count):
        since += 1
        if since <= until:
            yield numpy.zeros(4)
            continue
        yield WEIGHT_N * since * numpy.eye(4)[rng.integers(4)]
        since, until = 0, rng.choice(gaps)


def vanishing(rng, count):
    """A fifth of the steps have no contact, and the next one has the impulse of both."""
    since = 0
    for _ in range(count):
        since += 1
        if rng.random() < 0.2:
            yield numpy.zeros(4)
            continue
        yield WEIGHT_N / 4 * since * max(1 + 0.2 * rng.standard_normal(), 0) * numpy.ones(4)
        since = 0


class RestTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.model = cls.c.create_model(meshes.centred_box(BOX_M), MATERIAL).name
        cls.board = cls.c.create_model(meshes.centred_box(BOARD_M), MATERIAL, max_frequency_hz=4000).name

    def render(self, trace):
        return self.c.render(trace, sample_rate_hz=sound.RATE, tail_s=1).samples[:, 0]

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
        trace = carillon.Trace(step=1 / rate_hz)
        box, place = trace.add(self.model, MATERIAL), (0.03, 0.02, -0.015)
        trace.step(0, impacts=carillon.Impacts(box, [place], [(0, 0, 2)], durations=0.0005))
        for step in range(2 * rate_hz, 5 * rate_hz):
            trace.step(step / rate_hz, forces=carillon.ContactForces(box, [place], [(0, 0, 19.62)]))
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
        scene = falls.create_models(self.c, json.loads((falls.SCENES / "roll.json").read_text()))
        for engine in ("bullet", "ode"):
            with self.subTest(engine=engine):
                rolls = self.between(self.simulate(engine, scene, 240, 1.4), 0.3, 1.3)
                self.assertGreater(rms(rolls), 1e-5)
                excess = sound.lines_db(rolls, 240)
                print(f"lines at the step rate: {excess:.1f} dB over what is beside them", flush=True)
                self.assertLess(excess, 3)

    def slide(self, forces, rate_hz, depth, *, model=None):
        """The sound of a body, the box unless named, with these forces (N, on each corner of the box) in each step."""
        trace = carillon.Trace(step=1 / rate_hz)
        box = trace.add(model or self.model, MATERIAL, gain=0.01)
        for step, newtons in enumerate(forces):
            touching = newtons.nonzero()[0]
            impulses = [(-FRICTION * newtons[i] / rate_hz, 0, newtons[i] / rate_hz) for i in touching]
            contacts = carillon.Contacts(box, [CORNERS[i] for i in touching], impulses, partners=1,
                                         travel_speeds=SPEED_M_PER_S, roughness_depth=depth)
            trace.step(step / rate_hz, contacts=contacts if len(touching) else None)
        return self.c.render(trace, sample_rate_hz=sound.RATE, tail_s=0.1)

    def assert_no_lines(self, make_forces, depth, struck=True):
        for rate_hz in RATES_HZ:
            with self.subTest(rate_hz=rate_hz):
                forces = make_forces(numpy.random.default_rng(1), SECONDS * rate_hz)
                heard = self.slide(forces, rate_hz, depth)
                blows = heard.summary.findings.blow_count
                slides = heard.mono[int(0.3 * sound.RATE):int((SECONDS - 0.1) * sound.RATE)]
                lines = sound.lines_db(slides, rate_hz)
                print(f"{self.id().rsplit('.')[-1]}, {rate_hz} Hz: lines {lines:+.1f} dB, level "
                      f"{sound.level_db(slides):.1f} dB, {blows} blows", flush=True)
                self.assertLess(lines, LIMIT_DB)
                if struck is not None:
                    self.assertEqual(blows > 3, struck)

    def test_a_slide_with_a_jitter_over_jumping_points(self):
        self.assert_no_lines(jittering, 0.5, struck=False)

    def test_a_slide_that_loses_contact_for_single_steps(self):
        self.assert_no_lines(vanishing, 0.5, struck=None)

    def test_a_slide_that_hops_every_fifth_step(self):
        self.assert_no_lines(lambda rng, count: hopping(rng, count, [4]), 0)

    def test_a_slide_that_hops_unevenly(self):
        self.assert_no_lines(lambda rng, count: hopping(rng, count, range(3, 9)), 0.5)

    def test_a_jittering_load_does_not_click(self):
        """What an impact leaves has died away when the load alone is measured."""
        for rate_hz in RATES_HZ:
            with self.subTest(rate_hz=rate_hz):
                forces = list(jittering(numpy.random.default_rng(1), SECONDS * rate_hz))
                forces[0] = numpy.full(4, rate_hz / 4)  # 1 N s
                heard = self.slide(forces, rate_hz, 0, model=self.board).mono
                clicks = numpy.abs(numpy.diff(heard[int(2 * sound.RATE):int(2.9 * sound.RATE)], 2)).max()
                level = 20 * numpy.log10(clicks / numpy.abs(numpy.diff(heard, 2)).max() + 1e-30)
                print(f"{self.id().rsplit('.')[-1]}, {rate_hz} Hz: {level:.0f} dB of the impact", flush=True)
                self.assertLess(level, CLICKS_DB)



class FallsTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        scene = json.loads((falls.SCENES / "collision.json").read_text())
        cls.scene = falls.create_models(cls.c, scene)

    def test_the_same_collision_is_as_loud_from_every_engine(self):
        levels = {}
        for engine in falls.ENGINES:
            trace = self.folder / f"{engine}.contacts"
            falls.record(engine, self.scene, trace, rate=1000, seconds=0.3)
            sound = self.render(trace)
            self.assertEqual(sound.summary.limited_frame_count, 0)
            self.assertGreater(sound.summary.findings.blow_count, 0)
            levels[engine] = 10 * numpy.log10(numpy.sum(numpy.square(sound.mono)))
        median = statistics.median(levels.values())
        print({engine: round(level - median, 1) for engine, level in levels.items()}, flush=True)
        for engine, level in levels.items():
            self.assertLess(abs(level - median), 3, engine)

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
        return self.c.render(trace, sample_rate_hz=48000, tail_s=0.3)

    def strike(self, at):
        """A contact of a cube's corner, as an engine reports it at a place on the way to its middle."""
        trace = carillon.Trace(step=1 / 240)
        cube = trace.add(self.scene["bodies"][0]["model"], "concrete", gain=0.001)
        for step in range(20):
            contacts = carillon.Contacts(cube, [(at, at, at)], [(-0.3, -0.3, -0.3)]) if step == 2 else None
            trace.step(step / 240, contacts=contacts)
        return self.c.render(trace, sample_rate_hz=48000, tail_s=0.3)

    def test_a_contact_beneath_a_corner_sounds_as_one_at_the_corner(self):
        numpy.testing.assert_array_equal(self.strike(0.096).samples, self.strike(0.1).samples)
