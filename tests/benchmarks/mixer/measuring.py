# SPDX-License-Identifier: Apache-2.0
"""Runs programs and counts their CPU time."""

import resource
import statistics
import subprocess
import warnings


def cpu_seconds(command, **options):
    """CPU seconds, of the user's side, that a command takes."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL, **options)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def rate(run, short_s, long_s, times=3):
    """Seconds of sound a CPU second: run(seconds) returns CPU seconds; its fixed costs cancel out. The median."""
    return statistics.median((long_s - short_s) / max(run(long_s) - run(short_s), 1e-6) for _ in range(times))


def read_wave(path):
    """Samples of a 32-bit float WAV file of one channel."""
    import numpy
    from scipy.io import wavfile
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", wavfile.WavFileWarning)
        return numpy.asarray(wavfile.read(path)[1], dtype=float)


def error_db(sound, right):
    """Largest deviation over the largest value, and the same of root mean squares, dB."""
    import numpy
    count = min(len(sound), len(right))
    deviation = sound[:count] - right[:count]
    worst = numpy.abs(deviation).max() / numpy.abs(right).max()
    mean = numpy.sqrt((deviation ** 2).mean() / (right[:count] ** 2).mean())
    return tuple(20 * float(numpy.log10(max(x, 1e-20))) for x in (worst, mean))
