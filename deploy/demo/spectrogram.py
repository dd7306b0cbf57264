#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""spectrogram.py SOUND.wav PICTURE.png: draws what a WAV file of 24-bit samples sounds like."""

import os
import sys
import tempfile
import wave

# matplotlib wants a folder for its cache, and a home may be missing.
os.environ.setdefault("MPLCONFIGDIR", tempfile.gettempdir())
import matplotlib  # noqa: E402
import numpy  # noqa: E402

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

LOW_HZ, HIGH_HZ = 450, 12000
FLOOR_DB, TOP_DB = -120, -30
# The chimes of the paper's Table 2, their measured frequencies.
NOTES = {"D3": 585.8, "E3": 656.0, "G3": 781.8, "A4": 877.5, "B4": 982.5, "D4": 1167.0}


def read_wave(path):
    """Sample rate and the mean of the channels, full scale 1."""
    with wave.open(path, "rb") as sound:
        assert sound.getsampwidth() == 3, "not 24 bits"
        data = numpy.frombuffer(sound.readframes(sound.getnframes()), numpy.uint8)
        frames = data.reshape(-1, sound.getnchannels(), 3)
        rate = sound.getframerate()
    words = numpy.zeros(frames.shape[:2] + (4,), numpy.uint8)
    words[..., 1:] = frames
    return rate, words.view("<i4")[..., 0].mean(axis=1) / 2**31


def spectrogram(rate, samples):
    """(times in s, frequencies in Hz, levels in dB of a full-scale sine), band and hop as drawn."""
    size = 1 << int(numpy.log2(rate / 5))
    window = numpy.blackman(size)
    padded = numpy.pad(samples, size // 2)
    pieces = numpy.lib.stride_tricks.sliding_window_view(padded, size)[::size // 8]
    amplitudes = numpy.abs(numpy.fft.rfft(pieces * window)) * 2 / window.sum()
    frequencies = numpy.fft.rfftfreq(size, 1 / rate)
    band = (frequencies >= LOW_HZ) & (frequencies <= HIGH_HZ)
    times = numpy.arange(len(pieces)) * (size // 8) / rate
    return times, frequencies[band], 20 * numpy.log10(amplitudes[:, band].T + 1e-12)


def draw(rate, samples, path):
    figure, (level, picture) = pyplot.subplots(
        2, 1, sharex=True, figsize=(12, 7), layout="constrained", height_ratios=(1, 4))
    level.plot(numpy.arange(len(samples)) / rate, samples, linewidth=0.3)
    level.set_ylabel("full scale")
    level.set_title("Six wind chimes in a gust, simulated in Bullet, sounded by Carillon")
    level.set_xlim(0, len(samples) / rate)
    image = picture.pcolormesh(*spectrogram(rate, samples), vmin=FLOOR_DB, vmax=TOP_DB,
                               cmap="magma", shading="nearest", rasterized=True)
    picture.set_yscale("log")
    ticks = [500, 1000, 2000, 5000, 10000]
    picture.set_yticks(ticks, labels=[str(tick) for tick in ticks])
    picture.set_xlabel("time, s")
    picture.set_ylabel("frequency, Hz")
    notes = picture.secondary_yaxis("right")
    notes.set_yticks(list(NOTES.values()), labels=list(NOTES))
    notes.minorticks_off()
    figure.colorbar(image, ax=picture, label="dB of full scale", pad=0.04)
    figure.savefig(path, dpi=100)


if __name__ == "__main__":
    draw(*read_wave(sys.argv[1]), sys.argv[2])
