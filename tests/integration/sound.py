# SPDX-License-Identifier: Apache-2.0
"""The daemon's sound in numbers."""

import wave
from collections import namedtuple

import numpy

from carillon.v1 import contact_pb2

RATE = 48000

Partial = namedtuple("Partial", "frequency_hz decay_per_s amplitude")


def impulse(point, force, handle=1, duration_s=0.0):
    return contact_pb2.Contact(
        kind=contact_pb2.CONTACT_KIND_IMPACT, object=handle,
        point_m=contact_pb2.Vec3(x=point[0], y=point[1], z=point[2]),
        impulse_newton_seconds=contact_pb2.Vec3(x=force[0], y=force[1], z=force[2]),
        duration_s=duration_s)


def read_wave(path):
    """(frames, channels) of a 24-bit WAV file, full scale 1."""
    with wave.open(str(path), "rb") as file:
        assert file.getsampwidth() == 3 and file.getframerate() == RATE
        bytes_ = numpy.frombuffer(file.readframes(file.getnframes()), numpy.uint8)
        channels = file.getnchannels()
    words = numpy.zeros((len(bytes_) // 3, 4), numpy.uint8)
    words[:, 1:] = bytes_.reshape(-1, 3)
    return words.view("<i4").reshape(-1, channels) / 2**31


def measure(samples, frequency_hz, begin_s, end_s, smoothing_s=0.01):
    """The partial near a frequency of what was struck at time zero.

    Moves it to frequency zero, smooths with a Gaussian, and fits straight lines to the logarithm of
    the magnitude and to the phase between two times. Partials 100 Hz away are down by 170 dB.
    """
    reach = int(5 * smoothing_s * RATE)
    first, last = int(begin_s * RATE), int(end_s * RATE)
    assert first >= reach and last + reach <= len(samples)
    time = numpy.arange(first - reach, last + reach) / RATE
    moved = samples[first - reach:last + reach] * numpy.exp(-2j * numpy.pi * frequency_hz * time)
    kernel = numpy.exp(-0.5 * (numpy.arange(-reach, reach + 1) / (smoothing_s * RATE))**2)
    smooth = numpy.convolve(moved, kernel / kernel.sum(), "valid")
    time = time[reach:-reach]
    slope, intercept = numpy.polyfit(time, numpy.log(numpy.abs(smooth)), 1)
    turning, _ = numpy.polyfit(time, numpy.unwrap(numpy.angle(smooth)), 1)
    # Smoothing a decaying signal scales it by exp(slope^2 smoothing^2/2).
    amplitude = 2 * numpy.exp(intercept - (slope * smoothing_s)**2 / 2)
    return Partial(frequency_hz + turning / (2 * numpy.pi), slope, amplitude)


def spectral_peaks_hz(samples, floor_db):
    """Frequencies of the peaks of the spectrum of what was struck at time zero, down to `floor_db`
    below the highest, with parabolas. The window is the falling half of Blackman's, so that modes
    that die early count as they began, and a decaying mode has one smooth peak."""
    window = numpy.blackman(2 * len(samples))[len(samples):]
    spectrum = 20 * numpy.log10(numpy.abs(numpy.fft.rfft(samples * window)) + 1e-30)
    inner = spectrum[1:-1]
    peaks = 1 + numpy.flatnonzero((inner > spectrum[:-2]) & (inner >= spectrum[2:])
                                  & (inner > spectrum.max() + floor_db))
    left, middle, right = spectrum[peaks - 1], spectrum[peaks], spectrum[peaks + 1]
    offset = 0.5 * (left - right) / (left - 2 * middle + right)
    return (peaks + offset) * RATE / len(samples)


def level_db(samples):
    return 10 * numpy.log10(numpy.mean(numpy.square(samples)))


def lines_db(samples, step_rate_hz):
    """The mean level of the spectrum at the multiples of a step rate over that beside them, in decibels; about zero
    where there are no lines. Each spectrum is that of 24 steps, or of 0.1 s where these are longer."""
    size = int(RATE * max(24 / step_rate_hz, 0.1))
    pieces = numpy.lib.stride_tricks.sliding_window_view(samples, size)[::size // 2] * numpy.hanning(size)
    power = numpy.mean(numpy.abs(numpy.fft.rfft(pieces))**2, axis=0)
    level = 10 * numpy.log10(power + 1e-40)
    line = round(step_rate_hz * size / RATE)
    at = numpy.arange(line, len(power) - 8, line)
    at = at[at * RATE > 50 * size]  # below is what the window leaves of the mean
    beside = numpy.median([level[at + offset] for offset in range(-8, 9) if abs(offset) > 1], axis=0)
    return float(numpy.mean(level[at] - beside))
