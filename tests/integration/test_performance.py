# SPDX-License-Identifier: Apache-2.0
"""Lock step: the samples of each step come before the next, by the Python package and the real daemon."""

import asyncio

import numpy

import carillon
import meshes
from carillon import faces
from carillon.v1 import contact_pb2, performance_pb2
from daemon import DaemonTest

BAR = meshes.box(meshes.BAR_SIZE)
POINT, IMPULSE, DURATION_S = (0.0, 0.008, 0.010), (0, 0, -0.002), 1e-4
STEP_S, RATE_HZ = 0.02, 48000
FRAMES = round(STEP_S * RATE_HZ)
ABOVE = (0, 0, 1.5)


def strikes(step, environments):
    """The blows of a step, other ones in each environment of seven."""
    struck = [i for i in environments if (step + i % 7) % 3 == 0]
    if not struck:
        return None
    size = 1 + 0.1 * (numpy.array(struck) % 7)
    return carillon.Impacts(1, [POINT] * len(struck), numpy.outer(size, IMPULSE), durations=DURATION_S,
                            time_offsets=0.0013, environments=struck)


class PerformanceTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.model = cls.c.create_model(BAR, meshes.MATERIAL, label="bar", without_transfer=True)

    def begin(self, environments=1, microphones=(carillon.Omni(at=ABOVE),), **settings):
        sound = self.enterContext(self.c.perform(step=STEP_S, environments=environments, microphones=microphones,
                                                 **settings))
        sound.add(self.model)
        return sound

    def heard(self, environments, steps=20, shuffle=False, **settings):
        settings = {"microphones": [carillon.Omni(at=ABOVE)], **settings}
        order = list(range(environments))[::-1] if shuffle else range(environments)
        with self.c.perform(step=STEP_S, environments=environments, **settings) as sound:
            sound.add(self.model)
            return numpy.concatenate([sound.step(impacts=strikes(k, order))[0] for k in range(1, steps + 1)], axis=2)

    def test_the_same_bits_for_any_number_of_environments_and_order_of_rows(self):
        seven = self.heard(7)
        self.assertEqual((seven.shape, seven.dtype), ((7, 1, 20 * FRAMES), numpy.float32))
        self.assertGreater(abs(seven).max(), 0.01)
        numpy.testing.assert_array_equal(self.heard(1), seven[:1])
        numpy.testing.assert_array_equal(self.heard(64), seven[numpy.arange(64) % 7])
        numpy.testing.assert_array_equal(self.heard(64, shuffle=True), seven[numpy.arange(64) % 7])

    def test_samples_are_pascals_and_impacts_are_labels(self):
        sound = self.begin(2, tell_impacts=True)
        self.assertEqual((sound.sample_rate_hz, sound.channel_count, sound.latency), (RATE_HZ, 1, 0))
        samples, impacts = sound.step(impacts=carillon.Impacts(1, [POINT], [IMPULSE], durations=DURATION_S,
                                                               environments=[1]))
        self.assertFalse(samples.any())  # the step's contacts sound from its end on
        self.assertFalse(samples.flags.writeable)
        self.assertEqual((impacts.environments.tolist(), impacts.objects.tolist()), ([1], [1]))
        self.assertAlmostEqual(impacts.times[0], STEP_S, delta=1e-9)
        numpy.testing.assert_allclose(impacts.impulses[0], IMPULSE, atol=1e-9)
        numpy.testing.assert_allclose(impacts.points[0], POINT, atol=1e-3)
        samples, impacts = sound.step()
        self.assertEqual(len(impacts), 0)
        self.assertFalse(samples[0].any())
        trace = carillon.Trace(STEP_S)
        trace.add(self.model)
        trace.step(0, impacts=carillon.Impacts(1, [POINT], [IMPULSE], durations=DURATION_S))
        at_1_m = self.c.render(trace, tail_s=0.1)
        peak_pa = abs(at_1_m.samples[:FRAMES - 200]).max() * at_1_m.summary.full_scale_pa
        # The voice is a block late.
        self.assertAlmostEqual(abs(samples[1]).max() * 1.5 / peak_pa, 1, delta=0.01)

    def test_an_impact_is_found_among_reported_contacts(self):
        sound = self.begin(tell_impacts=True, frame="scene")
        told = []
        for k in range(1, 60):
            impulse = 0.002 if k == 5 else 0.0004 if k > 5 else 0
            contacts = carillon.Contacts(1, [POINT], [(0, 0, -impulse)], partners=7) if impulse else None
            _, impacts = sound.step(contacts=contacts, poses=carillon.Poses([1], [(0, 0, 0)]))
            told += [(k, *impulse, *impacts.times) for impulse in impacts.impulses]
        self.assertEqual(len(told), 1)
        self.assertAlmostEqual(told[0][4], 6 * STEP_S, delta=1e-3)  # it sounds a step after its report
        self.assertAlmostEqual(told[0][3], -0.002, delta=2e-4)

    def test_microphones_of_all_kinds_at_once(self):
        sound = self.begin(3, microphones=[
            carillon.Omni(at=ABOVE), carillon.Stereo(at=ABOVE), carillon.Ambisonics(at=(2, 0, 0), order=3),
            carillon.Omni(at=(0, 0, 1), on=1)])
        self.assertEqual(sound.channel_count, 1 + 2 + 16 + 1)
        sound.step(impacts=carillon.Impacts(1, [POINT] * 3, [IMPULSE] * 3, durations=DURATION_S, environments=range(3)),
                   poses=carillon.Poses([1] * 3, [(0, 0, 0)] * 3, environments=range(3)))
        samples, _ = sound.step()
        self.assertEqual(samples.shape, (3, 20, FRAMES))
        numpy.testing.assert_array_equal(samples[0], samples[2])
        peaks = abs(samples[0]).max(axis=1)
        numpy.testing.assert_allclose(peaks[0] * 1.5, peaks[19], rtol=1e-3)  # on the bar at 1 m, and at 1.5 m
        # The bar is at the left of the ambisonic microphone, which looks along -z.
        numpy.testing.assert_allclose(samples[0, 4], samples[0, 3], rtol=1e-5)
        self.assertLess(peaks[5], 1e-3 * peaks[3])

    def test_steps_come_in_several_messages_and_do_not_drift(self):
        with self.c.perform(step=1 / 90, environments=900, microphones=[carillon.Omni()] * 2) as sound:
            counts = [sound.step()[0].shape for _ in range(9)]
            self.assertEqual({shape[:2] for shape in counts}, {(900, 2)})
            self.assertEqual(sum(shape[2] for shape in counts), 4800)
            self.assertEqual(round(sound.latency * RATE_HZ), 16)

    def test_mistakes_are_refused(self):
        def impact(item, **more):
            return carillon.Impacts(item, [POINT], [IMPULSE], durations=DURATION_S, **more)

        sound = self.begin()
        with self.assert_refused("OBJECT_NOT_FOUND"):
            sound.step(impacts=impact(9))
        sound.step(impacts=impact(1))  # it goes on
        for act in (lambda: sound.step(impacts=impact(1, environments=[1])), lambda: sound.reset([77]),
                    lambda: sound.reset(-1), lambda: sound.add(self.model, environments=[1]),
                    lambda: sound.remove(1, [1])):
            with self.assert_refused("PERFORMANCE_MALFORMED"):
                act()
        sound.step(impacts=impact(1))  # none of these has ended it
        for act in (lambda: sound.step(time_scale=0.001), sound.reset):  # the first of which ends it
            with self.assert_refused("INVALID_STREAM"):
                act()
        for settings in (dict(environments=5000), dict(latency=1), dict(microphones=[carillon.Ambisonics(order=4)]),
                         dict(sample_rate_hz=10)):
            with self.subTest(settings), self.assert_refused("INVALID_SETTINGS"):
                self.begin(**settings)
        with self.assertRaises(ValueError):
            carillon.Trace(STEP_S).step(0, impacts=impact(1, environments=[0]))
        two = carillon.Impacts(1, [POINT] * 2, [IMPULSE] * 2, durations=DURATION_S, environments=[0])
        goes_on = self.begin(environments=3)
        for act in (lambda: goes_on.step(impacts=two), lambda: goes_on.reset(numpy.array([1, 0, 1]))):
            with self.assertRaises(ValueError):
                act()
        goes_on.step(impacts=impact(1))
        with self.assertRaises(TypeError):
            self.c.perform(step=STEP_S, channels=2)

    def test_what_comes_outside_of_the_block_is_refused(self):
        sound = self.c.perform(step=STEP_S)
        with self.assert_refused("INVALID_STREAM"):
            sound.step()
        with sound:
            for act in (lambda: sound.move_microphone(-1, ABOVE), lambda: sound.remove(-1)):
                with self.assertRaises(ValueError):
                    act()
            for act in (lambda: sound.add(None), lambda: sound.reset([1.5])):
                with self.assertRaises((TypeError, ValueError)):
                    act()
            sound.step()
        for act in (sound.step, sound.reset):
            with self.assert_refused("CONTACT_STREAM_ENDED"):
                act()

        async def give_up():
            async with carillon.aio.connect(self.daemon.server) as c, c.perform(step=STEP_S) as sound:
                with self.assertRaises(asyncio.TimeoutError):
                    await asyncio.wait_for(sound.step(), 1e-9)
                for _ in range(2):
                    with self.assert_refused("CONTACT_STREAM_ENDED"):
                        await sound.step()

        asyncio.run(give_up())

    def test_contacts_for_which_a_step_has_no_place_are_rejected_at_once(self):
        sound = self.begin()
        most = 8 * 64

        def heard(count):
            sound.reset()
            impacts = carillon.Impacts(1, [POINT] * count, [numpy.multiply(IMPULSE, 1e-3)] * count,
                                       durations=DURATION_S)
            if count <= most:
                sound.step(impacts=impacts)
            else:
                with self.assertRaises(carillon.CarillonError) as refused:
                    sound.step(impacts=impacts)
                self.assertEqual(refused.exception.reason, "TOO_MANY_CONTACTS")
            return sound.step()[0]

        full = heard(most)
        numpy.testing.assert_array_equal(heard(600), full)
        numpy.testing.assert_allclose(full, most * heard(1), rtol=0, atol=0.01 * abs(full).max())

    def test_many_objects_and_their_contacts_have_places_if_they_are_there_from_the_first_step_on(self):
        with self.c.perform(step=STEP_S, microphones=[carillon.Omni(at=ABOVE)], tell_impacts=True) as sound:
            many = numpy.repeat([sound.add(self.model) for _ in range(200)], 4)
            impacts = carillon.Impacts(many, [POINT] * 800, [numpy.multiply(IMPULSE, 1e-3)] * 800,
                                       durations=DURATION_S)
            self.assertEqual(len(sound.step(impacts=impacts)[1]), 800)

    def test_effects_leave_the_distance_from_which_on_the_level_falls(self):
        sound = self.begin(hearing={"distance_gain": True, "directivity": False},
                           microphones=[carillon.Omni(at=(0, 0, z)) for z in (0.2, 1)])
        sound.step(impacts=carillon.Impacts(1, [POINT], [IMPULSE], durations=DURATION_S))
        peaks = abs(sound.step()[0][0]).max(axis=1)
        self.assertAlmostEqual(peaks[0] / peaks[1], 5, delta=0.01)

    def test_what_is_not_finite_in_one_environment_costs_the_others_nothing(self):
        def impacts(environments, impulses):
            return carillon.Impacts([1] * len(environments), [POINT] * len(environments), impulses,
                                    durations=DURATION_S, environments=environments)

        clean, spoilt = self.begin(environments=3), self.begin(environments=3)
        for step in range(4):
            wanted, _ = clean.step(impacts=impacts([0, 2], [IMPULSE] * 2))
            with self.assertRaises(carillon.CarillonError) as refused:
                spoilt.step(impacts=impacts([0, 1, 2], [IMPULSE, (numpy.nan, 0, 0), IMPULSE]),
                            poses=carillon.Poses([1], [(numpy.inf, 0, 0)], environments=[1]))
            numpy.testing.assert_array_equal(refused.exception.performed[0], wanted)
            self.assertEqual(bool(wanted[[0, 2]].any()), step > 0)

    def test_what_is_wrong_in_one_environment_is_rejected_there_and_costs_the_others_nothing(self):
        def impacts(environments, **more):
            count = len(environments)
            return carillon.Impacts([1] * count, [POINT] * count, [IMPULSE] * count, durations=DURATION_S,
                                    environments=environments, **more)

        def rejected(reason, environment, act):
            """The performed step of an act that must be rejected so."""
            with self.assert_refused(reason) as refused:
                act()
            self.assertEqual(refused.exception.metadata.get("environment"), environment)
            return refused.exception.performed[0]

        clean, spoilt = self.begin(environments=3), self.begin(environments=3)

        def both(reason, environment, spoil, **more):
            """Two steps, of which `spoil` makes one wrong, sound alike where nothing is wrong."""
            wanted, _ = clean.step(impacts=impacts([0, 2]))
            samples = rejected(reason, environment, lambda: spoil(impacts=impacts([0, 2]), **more))
            numpy.testing.assert_array_equal(samples, wanted)
            numpy.testing.assert_array_equal(spoilt.step()[0], clean.step()[0])
            return wanted

        def with_striker(**content):
            return spoilt.step(contacts=carillon.Contacts(1, [POINT], [IMPULSE], environments=[1],
                                                          striker="marshmallow"), **content)

        def removing(**content):
            spoilt.remove(9, environments=[1])
            return spoilt.step(**content)

        def adding(**content):
            spoilt.add(self.model, environments=[1], handle=1)
            return spoilt.step(**content)

        def adding_unknown(**content):
            spoilt.add("modalModels/" + "0" * 64, environments=[1], handle=5)
            return spoilt.step(**content)

        def moving(**content):
            spoilt.move_microphone(7, ABOVE, environments=[1])
            return spoilt.step(**content)

        def strayed(**content):  # which the client does not send
            spoilt._next.removed_objects.add(object=1, environments=[77])
            return spoilt.step(**content)

        for reason, environment, spoil in (
                ("UNKNOWN_STRIKER", "1", with_striker), ("OBJECT_NOT_FOUND", "1", removing),
                ("OBJECT_EXISTS", "1", adding), ("MODAL_MODEL_NOT_FOUND", "1", adding_unknown),
                ("PERFORMANCE_MALFORMED", "1", moving), ("PERFORMANCE_MALFORMED", None, strayed)):
            with self.subTest(spoil.__name__):
                both(reason, environment, spoil)
        self.assertTrue(both("UNKNOWN_STRIKER", "1", with_striker)[[0, 2]].any())
        # The newest rejection is told, not that of the last environment that had one.
        rejected("OBJECT_NOT_FOUND", "2", lambda: (spoilt.remove(9, [2]), spoilt.step()))
        rejected("OBJECT_EXISTS", "0", lambda: (spoilt.add(self.model, handle=1, environments=[0]), spoilt.step()))
        # Columns that do not fit together, which the client does not send, are rejected as a list.
        step = performance_pb2.PerformStep()
        step.contacts.add(columns=contact_pb2.ContactColumns(object=[1, 1], point_m=[0] * 5), environment=[0, 2])
        answer = faces.finished(spoilt._ask(performance_pb2.PerformRequest(step=step))).samples
        self.assertEqual((answer.last_rejection.reason, answer.last_rejection.metadata["environment"]),
                         ("CONTACT_MALFORMED", "2"))
        self.assertEqual(answer.rejected_count, spoilt._rejected_count + 2)

    def test_environments_are_reset_by_a_mask(self):
        sound = self.begin(environments=3)
        sound.step(impacts=carillon.Impacts([1] * 3, [POINT] * 3, [IMPULSE] * 3, durations=DURATION_S,
                                            environments=range(3)))
        sound.step()
        sound.reset(numpy.array([False, True, False]))
        sound.reset([])  # nobody
        sound.reset([False] * 3)
        peaks = numpy.abs(sound.step()[0]).max(axis=(1, 2))
        self.assertEqual(peaks[1], 0)
        self.assertGreater(min(peaks[0], peaks[2]), 0)
        rows = carillon.Impacts([1] * 2, [POINT] * 2, [IMPULSE] * 2, durations=DURATION_S, environments=[True, False])
        for act in (lambda: sound.reset([True, False]), lambda: sound.reset(True), lambda: sound.remove(1, []),
                    lambda: sound.step(impacts=rows), lambda: self.c.perform(step=0),
                    lambda: self.c.perform(step=STEP_S, environments=0)):
            with self.assertRaises(ValueError):
                act()

    def test_asyncio_and_the_shape_of_gymnasium(self):
        async def perform():
            async with carillon.aio.connect(self.daemon.server) as c:
                async with c.perform(step=STEP_S, microphones=[carillon.Omni(at=ABOVE)]) as sound:
                    sound.add(self.model.name, meshes.MATERIAL)
                    return [(await sound.step(impacts=strikes(k, [0])))[0] for k in range(1, 6)]

        numpy.testing.assert_array_equal(numpy.concatenate(asyncio.run(perform()), axis=2), self.heard(1, 5))

        class Falling:
            observation_space, action_space = "poses", None

            def reset(self, seed=None, options=None):
                self.count = 0
                return 0.0, {}

            def step(self, action):
                self.count += 1
                return 0.0, 1.0, self.count == 5, False, {"count": self.count}

        hearing = carillon.HearingEnvironment(Falling(), self.begin(), lambda env: {"impacts": strikes(env.count, [0])})
        self.assertEqual(hearing.observation_space["sound"]["shape"], (1, FRAMES))
        episodes = []
        for _ in range(2):
            observation, _ = hearing.reset()
            self.assertFalse(observation["sound"].any())
            ended, sounds = False, []
            while not ended:
                observation, _, ended, _, info = hearing.step(None)
                sounds.append(observation["sound"])
            episodes.append(numpy.concatenate(sounds, axis=1))
            self.assertEqual(info["count"], 5)
        numpy.testing.assert_array_equal(episodes[0], episodes[1])
        numpy.testing.assert_array_equal(episodes[0], self.heard(1, 5)[0])
