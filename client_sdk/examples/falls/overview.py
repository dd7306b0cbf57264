#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Draws a frame and the spectrogram of each example into one picture: overview.py FOLDER OUT.png

FOLDER is where deploy/examples.sh with --video has left NAME-ENGINE.wav and NAME-ENGINE.mp4.
"""

import os
import pathlib
import subprocess
import sys
import tempfile

import numpy

NAMES = ("blocks", "boxes", "letters", "bowl", "wooden_bowl", "bunnies", "chimes")
FRAME_AT_S = {"bunnies": 1.0, "boxes": 0.8, "chimes": 2.6}
WIDTH, HEIGHT = 640, 360


def frame_of(video, at_s):
    """A frame of the video: rows, columns, RGB."""
    words = ["ffmpeg", "-loglevel", "error", "-ss", at_s, "-i", video, "-frames:v", 1, "-f", "rawvideo", "-pix_fmt",
             "rgb24", "-"]
    data = subprocess.run(list(map(str, words)), check=True, capture_output=True).stdout
    return numpy.frombuffer(data, numpy.uint8).reshape(HEIGHT, WIDTH, 3)


def sound_of(path):
    """The mean of the channels, 48 kHz."""
    words = ["ffmpeg", "-loglevel", "error", "-i", path, "-vn", "-ac", 1, "-ar", 48000, "-f", "f32le", "-"]
    return numpy.frombuffer(subprocess.run(list(map(str, words)), check=True, capture_output=True).stdout, "<f4")


def main(folder, out):
    os.environ.setdefault("MPLCONFIGDIR", tempfile.gettempdir())
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(len(NAMES), 2, figsize=(9, 1.9 * len(NAMES)), layout="constrained",
                                   width_ratios=(16, 20))
    for (left, right), name in zip(axes, NAMES):
        heard = min(folder.glob(f"{name}-*.wav"))
        samples = sound_of(heard)
        dither = numpy.random.default_rng(0).normal(scale=1e-10, size=len(samples))
        right.specgram(samples + dither, NFFT=2048, noverlap=1536, Fs=48, scale="dB", cmap="magma", vmin=-140,
                       vmax=-50)[3].set_extent((0, len(samples) / 48000, 0, 24))
        right.set_xlim(0, len(samples) / 48000)
        right.set_ylim(0, 20)
        right.set_ylabel("kHz")
        left.axis("off")
        left.set_title(f"{name.replace('_', ' ')}, {heard.stem.split('-')[1]}", fontsize=9)
        left.imshow(frame_of(heard.with_suffix(".mp4"), FRAME_AT_S.get(name, 0.6)))
    axes[-1][1].set_xlabel("time, s")
    figure.savefig(out, dpi=70)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), sys.argv[2])
