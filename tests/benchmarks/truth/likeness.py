# SPDX-License-Identifier: Apache-2.0
"""How far a sound is from a recording of it: multi-resolution STFT distance, and octave balance."""

import numpy
from scipy import signal

WINDOWS = (256, 512, 1024, 2048, 4096)
OCTAVES_HZ = (1000, 2000, 4000, 8000, 16000)
# Magnitudes below this part of a recording's largest count as equal to it.
FLOOR = 1e-4


def level(samples):
    return numpy.sqrt(numpy.mean(numpy.square(samples)))


def at_level_of(recording, sound):
    """The sound, cut or padded with silence to the length of the recording, as loud as it."""
    padded = numpy.zeros(len(recording))
    count = min(len(recording), len(sound))
    padded[:count] = sound[:count]
    return padded * (level(recording) / max(level(padded), 1e-30))


def magnitudes(samples, window):
    _, _, spectrum = signal.stft(samples, nperseg=window, noverlap=3 * window // 4, window="hann", boundary=None,
                                 padded=False)
    return numpy.abs(spectrum)


def mrstft(recording, sound):
    """Mean over five windows of the sum of the spectral convergence, |A - B| / |A| in Frobenius' norm, and of the
    mean absolute difference of the common logarithms of the magnitudes. Levels are made equal first."""
    sound = at_level_of(recording, sound)
    distances = []
    for window in WINDOWS:
        a, b = magnitudes(recording, window), magnitudes(sound, window)
        convergence = numpy.linalg.norm(a - b) / numpy.linalg.norm(a)
        floor = FLOOR * a.max()
        logarithms = numpy.abs(numpy.log10(numpy.maximum(a, floor) / numpy.maximum(b, floor)))
        distances.append(convergence + logarithms.mean())
    return float(numpy.mean(distances))


def octave_levels_db(samples, rate_hz):
    """Level of each octave, dB of the whole sound."""
    power = numpy.abs(numpy.fft.rfft(samples))**2
    hz = numpy.fft.rfftfreq(len(samples), 1 / rate_hz)
    bands = [power[(hz >= centre / 2**0.5) & (hz < centre * 2**0.5)].sum() for centre in OCTAVES_HZ]
    return 10 * numpy.log10(numpy.maximum(bands, 1e-30 * power.sum()) / power.sum())


def fast_level_db(pressures_pa, rate_hz):
    """The largest level that a sound level meter shows, dB(A) with the time constant of 125 ms (IEC 61672)."""
    hz = numpy.fft.rfftfreq(len(pressures_pa), 1 / rate_hz)
    weights = 1.2589 * (12194 * hz**2)**2 / ((hz**2 + 20.6**2) * (hz**2 + 12194**2)
                                             * numpy.sqrt((hz**2 + 107.7**2) * (hz**2 + 737.9**2)))
    weighted = numpy.fft.irfft(numpy.fft.rfft(pressures_pa) * weights, len(pressures_pa))
    kept = numpy.exp(-1 / (0.125 * rate_hz))
    power = signal.lfilter([1 - kept], [1, -kept], weighted**2)
    return float(10 * numpy.log10(max(power.max(), 1e-30) / 20e-6**2))


def octave_error_db(recording, sound, rate_hz):
    """Mean absolute difference of the octave levels, 1 to 16 kHz."""
    sound = at_level_of(recording, sound)
    return float(numpy.mean(numpy.abs(octave_levels_db(recording, rate_hz) - octave_levels_db(sound, rate_hz))))
