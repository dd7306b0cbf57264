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


def _label_strongest(axes: Any, frequencies: numpy.ndarray, level_db: numpy.ndarray, count: int = 5) -> None:
    """Writes their frequencies at the strongest peaks that are a fiftieth of the axis or more apart."""
    labelled: list[float] = []
    span = numpy.ptp(frequencies) if len(frequencies) else 0
    for i in numpy.argsort(level_db)[::-1]:
        if len(labelled) == count or level_db[i] < FLOOR_DB / 2:
            break
        if all(abs(frequencies[i] - other) > span / 50 for other in labelled):
            labelled.append(frequencies[i])
            axes.annotate(f"{frequencies[i]:.1f} Hz", (frequencies[i], level_db[i]), rotation=45, fontsize="x-small")


def plot_sound(sound: Any, axes: Any = None) -> Any:
    axes = _axes(axes)
    axes.plot(numpy.arange(len(sound.samples)) / sound.sample_rate_hz, sound.samples, linewidth=0.5)
    axes.set(title=f"{sound.seconds:.3g} s, peak {sound.peak:.3g} of full scale", xlabel="time / s",
             ylabel="sample / full scale")
    return axes


def plot_spectrum(sound: Any, axes: Any = None) -> Any:
    frequencies, magnitude = sound.spectrum()
    level = 20 * numpy.log10(numpy.maximum(magnitude / (magnitude.max() or 1), 1e-30))
    axes = _axes(axes)
    axes.plot(frequencies, numpy.maximum(level, FLOOR_DB), linewidth=0.5)
    peaks = numpy.flatnonzero((level[1:-1] > level[:-2]) & (level[1:-1] >= level[2:])) + 1
    _label_strongest(axes, frequencies[peaks], level[peaks])
    axes.set(title=f"spectrum of {sound.seconds:.3g} s", xlabel="frequency / Hz", ylabel="level / dB of the loudest",
             ylim=(FLOOR_DB, 20))
    return axes


def plot_modes(frequencies: numpy.ndarray, power: numpy.ndarray, title: str, axes: Any = None) -> Any:
    """Draws a line for each mode, as high as the sound power that it radiates at the same speed of vibration, in
    decibels below the strongest."""
    level = 10 * numpy.log10(numpy.maximum(power / (power.max(initial=0) or 1), 1e-30))
    axes = _axes(axes)
    axes.vlines(frequencies, FLOOR_DB, numpy.maximum(level, FLOOR_DB))
    _label_strongest(axes, frequencies, level)
    axes.set(title=title, xlabel="frequency / Hz", ylabel="sound power / dB of the strongest mode", ylim=(FLOOR_DB, 20))
    return axes


def plot_shape(arrays: dict[str, numpy.ndarray], mode: int, title: str, axes: Any = None) -> Any:
    """Draws the surface bent as one mode bends it, by a tenth of its size, and coloured by the displacement."""
    vertices, shape = arrays["vertices"], arrays["shapes"][:, :, mode]
    size = numpy.ptp(vertices, axis=0).max()
    bent = vertices + shape * (0.1 * size / numpy.abs(shape).max())
    axes = _axes(axes, projection="3d")
    triangles = arrays["triangles"]
    surface = axes.plot_trisurf(*bent.T, triangles=triangles)
    moved = numpy.linalg.norm(shape, axis=1)
    surface.set_array((moved / moved.max())[triangles].mean(axis=1))
    axes.figure.colorbar(surface, ax=axes, label="displacement / largest", shrink=0.6)
    axes.set_box_aspect(numpy.ptp(bent, axis=0))
    axes.set(title=title, xlabel="x / m", ylabel="y / m", zlabel="z / m")
    return axes
