# SPDX-License-Identifier: Apache-2.0
"""Pictures of sounds and of modal models, by matplotlib (the extra `plot` of the package)."""

from __future__ import annotations

from typing import Any

import numpy

FLOOR_DB = -100


def _axes(axes: Any, **subplot: Any) -> Any:
    if axes is not None:
        return axes
    import matplotlib.pyplot
    return matplotlib.pyplot.figure().add_subplot(**subplot)


def plot_sound(sound: Any, axes: Any = None) -> Any:
    axes = _axes(axes)
    axes.plot(numpy.arange(len(sound.samples)) / sound.sample_rate_hz, sound.samples, linewidth=0.5)
    axes.set(xlabel="time / s", ylabel="amplitude")
    return axes


def plot_spectrum(sound: Any, axes: Any = None) -> Any:
    frequencies, magnitude = sound.spectrum()
    level = 20 * numpy.log10(numpy.maximum(magnitude / magnitude.max(), 1e-30))
    axes = _axes(axes)
    axes.plot(frequencies, numpy.maximum(level, FLOOR_DB), linewidth=0.5)
    axes.set(xlabel="frequency / Hz", ylabel="level / dB", ylim=(FLOOR_DB, 3))
    return axes


def plot_modes(frequencies: numpy.ndarray, couplings: numpy.ndarray, axes: Any = None) -> Any:
    """Draws a line for each mode, as high as its coupling to the air in decibels below the strongest."""
    level = 20 * numpy.log10(numpy.maximum(couplings / couplings.max(), 1e-30))
    axes = _axes(axes)
    axes.vlines(frequencies, FLOOR_DB, numpy.maximum(level, FLOOR_DB))
    axes.set(xlabel="frequency / Hz", ylabel="coupling / dB", ylim=(FLOOR_DB, 3))
    return axes


def plot_shape(arrays: dict[str, numpy.ndarray], mode: int, axes: Any = None) -> Any:
    """Draws the surface bent as one mode bends it, by a tenth of its size, and coloured by the displacement."""
    vertices, shape = arrays["vertices"], arrays["shapes"][:, :, mode]
    size = numpy.ptp(vertices, axis=0).max()
    bent = vertices + shape * (0.1 * size / numpy.abs(shape).max())
    axes = _axes(axes, projection="3d")
    triangles = arrays["triangles"]
    surface = axes.plot_trisurf(*bent.T, triangles=triangles)
    surface.set_array(numpy.linalg.norm(shape, axis=1)[triangles].mean(axis=1))
    axes.set_box_aspect(numpy.ptp(bent, axis=0))
    axes.set_axis_off()
    return axes
