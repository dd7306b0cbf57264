# SPDX-License-Identifier: Apache-2.0
"""The scale of time: slow motion spreads what strikes and keeps its pitch, a pause is silent, fast forward drops
nothing."""

import unittest

import numpy

import carillon
from test_python_package import DURATION_S, IMPULSE, POINT, PackageTest

STEP_S, BLOW_EVERY, STEP_COUNT, RATE_HZ = 1 / 64, 8, 33, 48000
BLOW = {"points": POINT, "impulses": IMPULSE, "durations": DURATION_S}
# Each blow is over before the next, so that the times at which the sound begins anew can be told.
DEAD = carillon.material("chime_aluminum", alpha1_s=0, alpha2_per_s=400)


def blows(item, time_scale):
    """Yields the steps of a simulation, with a blow in every eighth."""
    for i in range(STEP_COUNT):
        struck = carillon.Impacts(item, **BLOW) if i % BLOW_EVERY == 0 else None
        yield i * STEP_S, {"impacts": struck, "time_scale": time_scale}


def onsets_s(samples):
    """The times at which a sound begins after silence."""
    loud = numpy.abs(samples) > 0.3 * numpy.abs(samples).max()
    frames = numpy.flatnonzero(loud)
    return frames[numpy.flatnonzero(numpy.diff(frames, prepend=-RATE_HZ) > 0.01 * RATE_HZ)] / RATE_HZ


class TimeScaleTest(PackageTest):
    def rendered(self, steps):
        trace = carillon.Trace(STEP_S)
        bar = trace.add(self.model, DEAD)
        for time_s, content in steps(bar):
            trace.step(time_s, **content)
        return self.c.render(trace, tail_s=0.2, sample_rate_hz=RATE_HZ)

    def test_a_rendering_spreads_blows_and_keeps_their_sound(self):
        usual = self.rendered(lambda bar: blows(bar, None))
        for time_scale in (0.25, 0.5, 2, 4):
            with self.subTest(time_scale):
                sound = self.rendered(lambda bar, scale=time_scale: blows(bar, scale))
                spacing_s = BLOW_EVERY * STEP_S / time_scale
                if time_scale < 4:
                    numpy.testing.assert_allclose(numpy.diff(onsets_s(sound.samples[:, 0])), spacing_s, atol=2e-4)
                self.assertEqual(sound.summary.accepted_count, usual.summary.accepted_count)
                first = slice(0, int(min(spacing_s, BLOW_EVERY * STEP_S) * RATE_HZ))
                numpy.testing.assert_allclose(sound.samples[first, 0], usual.samples[first, 0], atol=1e-6 * usual.peak)

    def test_a_pause_is_silent_and_lasts_as_long_as_its_steps(self):
        def steps(bar, pauses):
            for i in range(17):
                yield i * STEP_S, {"impacts": carillon.Impacts(bar, **BLOW) if i in (0, 16) else None}
                if i == 8:
                    for _ in range(64 if pauses else 0):
                        yield i * STEP_S, {"impacts": carillon.Impacts(bar, **BLOW), "time_scale": 0}
        usual = self.rendered(lambda bar: steps(bar, False))
        paused = self.rendered(lambda bar: steps(bar, True))
        self.assertEqual(paused.summary.accepted_count, 2)
        numpy.testing.assert_allclose(onsets_s(paused.samples[:, 0]) - onsets_s(usual.samples[:, 0]), [0, 1], atol=1e-4)
        self.assertEqual([one.id for one in paused.summary.warnings], [])

    def test_a_scale_that_is_none_is_refused(self):
        for wrong in (-1, 1e-4, 1e4, float("nan"), "slow"):
            with self.assertRaisesRegex(ValueError, "time_scale is .* 0.001 to 1000, or 0 in a pause"):
                carillon.Trace(STEP_S).step(0, time_scale=wrong)


if __name__ == "__main__":
    unittest.main()
