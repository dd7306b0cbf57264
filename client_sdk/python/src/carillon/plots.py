# SPDX-License-Identifier: Apache-2.0
"""Pictures of sounds and of modal models, by matplotlib (the extra `plot` of the package)."""

from __future__ import annotations

from typing import Any

import numpy

from carillon.sound import Sound

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


def plot_fit(found: Any, body: str, axes: Any = None) -> Any:
    """Draws how a material explains the recordings of a body (Fit.plot)."""
    if axes is None:
        import matplotlib.pyplot
        axes = matplotlib.pyplot.figure(figsize=(9, 7)).subplots(2, 1, sharex=True)
    lines = [line for line in found.lines if line.body == body]
    _plot_matches(found, body, lines, axes[0])
    _plot_decays(found.laws[:1], lines, axes[1])
    return axes


def _plot_matches(found: Any, body: str, lines: list[Any], axes: Any) -> None:
    matched, free = [[line for line in lines if (line.mode is None) == alone] for alone in (False, True)]
    highest = 1.1 * max((line.frequency_hz for line in lines), default=1)
    for path in found.recordings[body]:
        if str(path).lower().endswith((".wav", ".wave")):
            hz, magnitude = Sound.load(path).spectrum()
            level = 20 * numpy.log10(numpy.maximum(magnitude / (magnitude.max() or 1), 1e-30))
            axes.plot(hz[hz < highest], numpy.maximum(level, FLOOR_DB)[hz < highest], color="0.7", linewidth=0.5)
    taken = {line.mode for line in matched}
    others = [hz for mode, hz in enumerate(found.modes_hz[body], 1) if mode not in taken and hz < highest]
    axes.vlines(others, FLOOR_DB, FLOOR_DB + 15, color="C3", label=f"{len(others)} modes without a line")
    axes.vlines([line.model_hz for line in matched], FLOOR_DB, FLOOR_DB + 15, color="C0", label="modes with a line")
    axes.plot([line.frequency_hz for line in matched], [line.level_db for line in matched], "o", color="C0",
              label=f"{len(matched)} lines, {100 * found.rms:.2g} % from their modes")
    axes.plot([line.frequency_hz for line in free], [line.level_db for line in free], "x", color="C3",
              label=f"{len(free)} lines without a mode")
    axes.set(title=f"{body}: E {found.young_pa / 1e9:.4g} GPa at {found.density_kg_per_m3:.4g} kg/m^3, "
             f"Poisson's ratio {found.poisson_ratio:.3f}", ylabel="level / dB of the strongest", ylim=(FLOOR_DB, 10))
    axes.legend(fontsize="x-small")


def _plot_decays(laws: list[dict[str, Any]], lines: list[Any], axes: Any) -> None:
    known = [line for line in lines if line.decay_per_s > 0]
    hz = numpy.array([line.frequency_hz for line in known])
    for style, color, alone in (("o", "C0", False), ("x", "C3", True)):
        drawn = [line for line in known if (line.mode is None) == alone]
        axes.errorbar([line.frequency_hz for line in drawn], [line.decay_per_s for line in drawn],
                      [line.decay_error_per_s for line in drawn], fmt=style, color=color, markersize=4, capsize=2)
    for law in laws:
        grid = numpy.geomspace(max(1, hz.min(initial=20)), hz.max(initial=20000), 300)
        omega, eta = 2 * numpy.pi * grid, numpy.zeros_like(grid)
        if law["loss_factor"]:
            table = numpy.log([(point["frequency_hz"], point["loss_factor"]) for point in law["loss_factor"]])
            eta = numpy.exp(numpy.interp(numpy.log(grid), table[:, 0], table[:, 1]))
        axes.plot(grid, (law["alpha1_s"] * omega**2 + law["alpha2_per_s"] + eta * omega) / 2, color="C0",
                  label=f"the material: {law['name']}, within x{law['missed_by']:.2f}")
    radiating = [line for line in known if line.radiation_per_s > 0]
    if radiating:
        axes.plot([line.frequency_hz for line in radiating], [line.radiation_per_s for line in radiating], "+",
                  color="C1", label="radiation")
    axes.set(xlabel="frequency / Hz", ylabel="decay rate / (1/s)", yscale="log")
    if axes.get_legend_handles_labels()[1]:
        axes.legend(fontsize="x-small")
