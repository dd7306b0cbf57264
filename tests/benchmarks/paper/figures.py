# SPDX-License-Identifier: Apache-2.0
"""The paper's figure 5, the spectra of blocks and boxes, from strikes that the daemon renders."""

import pathlib

import bench
import numpy
import programs

RATE_HZ, HIGHEST_HZ, SPAN_S = 48000, 5000, 1.0
# A corner, struck aslant. A collision of bodies ten times as large at the same speed lasts ten times as long.
STRUCK, BLOW = (.9, .8, 1.), (.3, .5, -1.)
BLOCK_CONTACT_S = 2e-4


def strike(studio, folder, row, side_m):
    """What is heard of a cube that is struck, as the paper renders it: its coupling, damping and Gaussian."""
    heard = programs.Heard(studio.import_model(folder / f"{row.name}.model"), row.material.figures())
    impulse = 1e-3 * (side_m / .05)**3
    blow = programs.Blow(tuple(side_m * x for x in STRUCK), tuple(impulse * x for x in BLOW),
                         BLOCK_CONTACT_S * side_m / .05)
    sound, _ = studio.render(heard, [blow], SPAN_S)
    return sound


def spectrum(sound, scaled=True):
    """(Hz, amplitude) up to 5000 Hz; the greatest amplitude is 1 if it is `scaled`."""
    padded = numpy.zeros(int(RATE_HZ * SPAN_S))
    padded[:min(len(padded), len(sound))] = sound[:len(padded)]
    hz = numpy.fft.rfftfreq(len(padded), 1 / RATE_HZ)
    amplitude = numpy.abs(numpy.fft.rfft(padded))
    shown = hz <= HIGHEST_HZ
    return hz[shown], amplitude[shown] / (amplitude[shown].max() if scaled else 1)


def draw(spectra, path):
    pyplot = bench.pyplot()
    figure, axes = pyplot.subplots(1, len(spectra), figsize=(9, 2.8), layout="constrained")
    for axis, (title, (hz, amplitude)) in zip(axes, spectra.items()):
        axis.fill_between(hz, amplitude, color="tab:blue")
        axis.set_xlim(0, HIGHEST_HZ)
        axis.set_ylim(0, 1.05)
        axis.set_xlabel("frequency, Hz")
        axis.set_title(title)
    axes[0].set_ylabel("amplitude over its greatest")
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


def figure5(rows, folder, path):
    """Draws it; returns for each body the frequency of its highest peak and that below which half its energy lies,
    in Hz."""
    spectra, figures = {}, {}
    with programs.studio() as studio:
        for name, side_m, title in (("blocks", .05, "block of 5 cm"), ("boxes", .5, "box of 50 cm")):
            spectra[title] = hz, amplitude = spectrum(strike(studio, pathlib.Path(folder), rows[name], side_m))
            energy = numpy.cumsum(amplitude**2)
            figures[name] = hz[amplitude.argmax()], hz[numpy.searchsorted(energy, energy[-1] / 2)]
    draw(spectra, path)
    return figures
