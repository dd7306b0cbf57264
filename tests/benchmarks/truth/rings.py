# SPDX-License-Identifier: Apache-2.0
"""The modes that a recording of a struck body holds: frequency, decay rate and amplitude."""

import dataclasses

import numpy
from scipy import signal

RATE_HZ = 48000


@dataclasses.dataclass
class Ring:
    hz: float
    decay_per_s: float
    decay_error_per_s: float  # standard error
    amplitude: float  # at the beginning of the recording
    span_s: float  # how long it stands above the noise


def read(path):
    """The first channel at 48 kHz, without its hum below 200 Hz."""
    import soundfile  # Only recordings of others need it.

    samples, rate_hz = soundfile.read(path, always_2d=True)
    common = numpy.gcd(rate_hz, RATE_HZ)
    sound = signal.resample_poly(samples[:, 0], RATE_HZ // common, rate_hz // common)
    return signal.sosfiltfilt(signal.butter(4, 200, "highpass", fs=RATE_HZ, output="sos"), sound)


def envelope(sound, hz, smoothing_s):
    """Times, and the complex amplitude near a frequency, where a Gaussian window fits into the sound."""
    reach = int(3 * smoothing_s * RATE_HZ)
    kernel = numpy.exp(-0.5 * (numpy.arange(-reach, reach + 1) / (smoothing_s * RATE_HZ))**2)
    time = numpy.arange(len(sound)) / RATE_HZ
    moved = sound * numpy.exp(-2j * numpy.pi * hz * time)
    smooth = signal.fftconvolve(moved, kernel / kernel.sum(), "valid")
    return time[reach:len(time) - reach], smooth


def noise_beside(sound, hz, smoothing_s, offset_hz):
    """The quieter of the median magnitudes at both sides."""
    return min(numpy.median(numpy.abs(envelope(sound, hz + side * offset_hz, smoothing_s)[1])) for side in (-1, 1))


def ring_near(sound, hz, smoothing_s=0.006, least_span_s=0.03):
    """The ring nearest to a frequency; None where nothing stands clear of the noise.

    Straight lines are fitted to the logarithm of the magnitude and to the phase, from the first moment that no
    window cuts, until the magnitude falls to four times the noise beside. The errors of neighbouring samples of
    the envelope are alike, so that one in every `smoothing_s` is counted.
    """
    for _ in range(2):  # The second time about the frequency that the first has found.
        time, smooth = envelope(sound, hz, smoothing_s)
        clear = numpy.abs(smooth) > 4 * noise_beside(sound, hz, smoothing_s, 3.5 / (2 * numpy.pi * smoothing_s))
        end = len(clear) if clear.all() else int(numpy.argmin(clear))
        if end < least_span_s * RATE_HZ:
            return None
        time, smooth = time[:end], smooth[:end]
        turning, _ = numpy.polyfit(time, numpy.unwrap(numpy.angle(smooth)), 1)
        hz += turning / (2 * numpy.pi)
    (slope, intercept), covariance = numpy.polyfit(time, numpy.log(numpy.abs(smooth)), 1, cov=True)
    error = numpy.sqrt(covariance[0, 0] * smoothing_s * RATE_HZ)
    amplitude = 2 * numpy.exp(intercept - (slope * smoothing_s)**2 / 2)
    return Ring(float(hz), float(-slope), float(error), float(amplitude), float(time[-1] - time[0]))
