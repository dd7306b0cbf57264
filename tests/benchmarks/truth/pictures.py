# SPDX-License-Identifier: Apache-2.0
"""Spectrograms side by side."""

import math

import numpy

import bench
import rings

WINDOW, RANGE_DB = 512, 70
QUIETEST_DB = -160  # a sound whose loudest point is below it stays black


def draw(sounds, path, seconds, columns=4):
    """Draws [(title, samples)] to a PNG file, each on a scale of its own loudest point, and says where."""
    pyplot = bench.pyplot()
    rows = math.ceil(len(sounds) / columns)
    figure, axes = pyplot.subplots(rows, columns, figsize=(3.1 * columns, 2.1 * rows), sharex=True, sharey=True,
                                   squeeze=False)
    for axis in axes.flat[len(sounds):]:
        axis.axis("off")
    for axis, (title, samples) in zip(axes.flat, sounds):
        shown = numpy.zeros(int(seconds * rings.RATE_HZ))
        shown[:min(len(shown), len(samples))] = samples[:len(shown)]
        noise = 1e-12 * numpy.random.default_rng(1).standard_normal(len(shown))  # no logarithm of zero
        power, _, _, image = axis.specgram(shown + noise, WINDOW, rings.RATE_HZ, noverlap=3 * WINDOW // 4,
                                           cmap="inferno")
        loudest = max(10 * numpy.log10(power.max()), QUIETEST_DB)
        image.set_clim(loudest - RANGE_DB, loudest)
        axis.set_title(title, fontsize=8)
        axis.set_ylim(0, 20000)
        axis.set_yticks(range(0, 20001, 5000), [f"{khz} kHz" for khz in range(0, 21, 5)], fontsize=7)
        axis.tick_params(axis="x", labelsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    pyplot.close(figure)
    print(f"drawn: {path}\n")
