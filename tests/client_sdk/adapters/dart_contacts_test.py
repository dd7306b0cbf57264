# SPDX-License-Identifier: Apache-2.0
"""The adapter for DART with its engine: a box falls, slides and rests."""

import unittest

import numpy

from dart_drop import FRICTION, GRAVITY_M_PER_S2, HALF_M, HEIGHT_M, MASS_KG, SPEED_M_PER_S, DartDrop

TILTED = (0.84419, 0.3485584, -0.4056972, -0.03549596)


def impulse_of(step):
    return numpy.sum(step["contacts"].impulses, axis=0) if "contacts" in step else numpy.zeros(3)


class DartContactsTest(unittest.TestCase):
    def test_impulses_are_the_change_of_momentum(self):
        for rate in (60, 240, 1000):
            for orientation in ((1, 0, 0, 0), TILTED):
                drop, total = DartDrop(1 / rate, orientation), 0
                for _ in range(rate):
                    before = drop.momentum()
                    impulse = impulse_of(drop.step())
                    gained = drop.momentum() - before + [0, 0, MASS_KG * GRAVITY_M_PER_S2 / rate]
                    numpy.testing.assert_allclose(impulse, gained, atol=1e-5)
                    total += impulse[2]
                self.assertGreater(total, MASS_KG * GRAVITY_M_PER_S2 * 0.9)

    def test_a_blow_is_at_the_corners_by_the_pose_that_is_sent_with_it(self):
        drop = DartDrop(1 / 60)
        step = next(step for step in iter(drop.step, None) if "contacts" in step)
        contacts, position = step["contacts"], step["poses"].positions[0]
        numpy.testing.assert_allclose(abs(contacts.points - position)[:, :2], [HALF_M[:2]] * 4, atol=1e-6)
        fall_m_per_s = (2 * GRAVITY_M_PER_S2 * (HEIGHT_M - HALF_M[2])) ** 0.5
        self.assertAlmostEqual(impulse_of(step)[2], MASS_KG * fall_m_per_s, delta=0.2)
        # The floor stops the slide within the step.
        self.assertAlmostEqual(impulse_of(step)[0], -MASS_KG * SPEED_M_PER_S[0], delta=0.01)
        self.assertGreater(FRICTION * impulse_of(step)[2], MASS_KG * SPEED_M_PER_S[0])
        self.assertEqual((contacts.objects.tolist(), contacts.second_objects.tolist()), ([1] * 4, [0] * 4))
        self.assertEqual(contacts.partners.tolist(), [0] * 4)

    def test_a_removed_body_sounds_no_more(self):
        drop = DartDrop(1 / 240)
        while "contacts" not in drop.step():
            pass
        drop.contacts.remove_object(drop.body)
        self.assertEqual([drop.step() for _ in range(3)], [{}] * 3)
