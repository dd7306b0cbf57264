#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Draws a frame and the spectrogram of each example into one picture: overview.py FOLDER OUT.png

FOLDER is where deploy/examples.sh with --video has left NAME-ENGINE.wav and NAME-ENGINE.mp4.
"""

import io
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy

from run import draw_spectrogram

NAMES = ("blocks", "boxes", "letters", "bowl", "wooden_bowl", "bunnies", "chimes")
FRAME_AT_S = {"bunnies": 1.0, "boxes": 0.8, "chimes": 2.6}
SAMPLE_RATE_HZ = 48000


def ffmpeg(*words):
    """Returns the bytes that ffmpeg writes."""
    words = ["ffmpeg", "-loglevel", "error", *map(str, words), "-"]
    return subprocess.run(words, check=True, capture_output=True).stdout


def frame_of(video, at_s):
    """Returns a frame of the video as a PNG file in memory."""
    return io.BytesIO(ffmpeg("-ss", at_s, "-i", video, "-frames:v", 1, "-f", "image2pipe", "-codec:v", "png"))


def sound_of(path):
    """Returns the mean of the channels."""
    return numpy.frombuffer(ffmpeg("-i", path, "-vn", "-ac", 1, "-ar", SAMPLE_RATE_HZ, "-f", "f32le"), "<f4")


def main(folder, out):
    os.environ.setdefault("MPLCONFIGDIR", tempfile.gettempdir())
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(len(NAMES), 2, figsize=(9, 1.9 * len(NAMES)), layout="constrained",
                                   width_ratios=(16, 20))
    for (left, right), name in zip(axes, NAMES):
        heard = min(folder.glob(f"{name}-*.wav"))
        draw_spectrogram(right, sound_of(heard), SAMPLE_RATE_HZ)
        right.set_ylim(0, 20)
        right.set_ylabel("kHz")
        left.axis("off")
        left.set_title(f"{name.replace('_', ' ')}, {heard.stem.split('-')[1]}", fontsize=9)
        left.imshow(pyplot.imread(frame_of(heard.with_suffix(".mp4"), FRAME_AT_S.get(name, 0.6))))
    axes[-1][1].set_xlabel("time, s")
    figure.savefig(out, dpi=70)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), sys.argv[2])
