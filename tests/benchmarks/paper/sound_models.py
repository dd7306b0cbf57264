# SPDX-License-Identifier: Apache-2.0
"""One blow by the paper's sound model and by Carillon's, with each ingredient exchanged in turn."""

import dataclasses
import math
import pathlib

import bench
import catalogue
import figures
import numpy
import programs
from bench import head, row as line

RATE_HZ, SPAN_S, FULL_SCALE_PA, HEARD_PA = 48000, 3.0, 200.0, 20e-6
CONTACT_S, IMPULSE_NS = 2e-4, 2e-3
HIGHEST_HZ, ACCURACY_DB, BUDGET_S = 5000, 2, 20


@dataclasses.dataclass
class Case:
    """`row` of Table 1, what is struck (the vertex farthest along `side`, inwards), and the material of the catalogue
    whose loss factor the true damping takes. The elastic constants and the density stay those of the row."""
    row: str
    title: str
    side: tuple
    damped_as: str


CASES = (Case("chime (D3)", "chime", (1., 0, .2), "aluminum_6061"), Case("bowl 1", "bowl", (1., 0, .5), "brass"),
         Case("blocks", "block", (.9, .8, 1.), "oak"))
PAPER, CONTACT, RADIATION, OURS = ("the paper's", "with elastic contact", "and computed radiation",
                                   "and loss factor: Carillon's")


def variants(case, row, model):
    """{name: what is heard and how long the contact lasts in s}, from the paper's model to Carillon's."""
    rayleigh = row.material.figures()
    loss = programs.loss_factor(catalogue.read()[case.damped_as].loss_factor)
    heard = programs.Heard(model, rayleigh)
    elastic = dataclasses.replace(heard, gaussian=False)
    radiating = dataclasses.replace(elastic, paper_coupling=False)
    return {PAPER: (heard, CONTACT_S), CONTACT: (elastic, None), RADIATION: (radiating, None),
            OURS: (dataclasses.replace(radiating, material={**rayleigh, **loss}), None)}


def blow_on(vertices, side, duration_s):
    direction = numpy.array(side) / numpy.linalg.norm(side)
    point = vertices[(vertices @ direction).argmax()]
    return programs.Blow(tuple(map(float, point)), tuple(-IMPULSE_NS * direction), duration_s)


def sounds(solver, case, row):
    """{name of the variant: pressure at 1 m in Pa}. Decomposes the body with its modes to HIGHEST_HZ."""
    name = f"{row.name}, sound"
    solver.solve(row.fine(), name, [*row.options, "--band", f"20:{HIGHEST_HZ}", *row.material.options()])
    vertices = figures.arrays_of(solver.folder, name)["vertices"]
    made = {}
    with programs.studio() as studio:
        model = studio.import_model(solver.folder / f"{name}.model")
        studio.radiate(model, row.material.figures(), "--accuracy", ACCURACY_DB, "--budget", BUDGET_S)
        for variant, (heard, duration_s) in variants(case, row, model).items():
            sound, summary = studio.render(heard, [blow_on(vertices, case.side, duration_s)], SPAN_S)
            if int(summary.get("limited_frame_count", 0)):
                raise RuntimeError(f"{name}: beyond full scale, so that its level would be wrong")
            made[variant] = FULL_SCALE_PA * sound
    return made


def levels(sound):
    """(peak in Pa, exposure level in dB re 20 uPa and 1 s, Hz below which half the energy lies, time in s after which
    the sound stays 40 dB below its loudest 10 ms)."""
    exposure = 10 * math.log10((sound**2).sum() / RATE_HZ / HEARD_PA**2)
    energy = numpy.cumsum(numpy.abs(numpy.fft.rfft(sound))**2)
    middle = numpy.searchsorted(energy, energy[-1] / 2) * RATE_HZ / len(sound)
    length = RATE_HZ // 100
    parts = (sound[:len(sound) // length * length].reshape(-1, length)**2).mean(axis=1)
    last = numpy.flatnonzero(parts > 1e-4 * parts.max())[-1]
    return numpy.abs(sound).max(), exposure, middle, (last + 1) / 100


def draw(made, path):
    """A spectrogram of the first and the last variant of each body, on one scale of sound pressure level."""
    pyplot = bench.pyplot()
    figure, axes = pyplot.subplots(2, len(made), figsize=(9, 4.6), layout="constrained", sharex="col", sharey=True)
    for column, (title, variants_made) in zip(axes.T, made.items()):
        shown_s = min(SPAN_S, 1.2 * max(levels(variants_made[name])[3] for name in (PAPER, OURS)))
        for axis, name, label in zip(column, (PAPER, OURS), ("the paper's", "Carillon's")):
            sound = variants_made[name] / HEARD_PA
            padded = numpy.concatenate([sound, numpy.zeros(int(SPAN_S * RATE_HZ))])[:int(shown_s * RATE_HZ)]
            noise = numpy.random.default_rng(0).normal(scale=1e-3, size=len(padded))  # digital silence has no level
            _, _, _, image = axis.specgram(padded + noise, NFFT=1024, noverlap=896, Fs=RATE_HZ / 1000, cmap="magma",
                                           vmin=-20, vmax=70)
            image.set_extent((0, 1000 * shown_s, 0, RATE_HZ / 2000))
            axis.set(title=f"{title}, {label}", ylim=(0, 1.25 * HIGHEST_HZ / 1000), xlim=(0, 1000 * shown_s))
        column[-1].set_xlabel("ms")
    for axis in axes[:, 0]:
        axis.set_ylabel("kHz")
    figure.colorbar(image, ax=axes, label="dB re 20 uPa, per kHz")
    figure.savefig(path, dpi=72)
    pyplot.close(figure)


def compare(solver, rows, picture, folder):
    """Draws the picture and leaves each sound in the folder. Returns the lines of the table."""
    import carillon
    lines = head("body", "sound model", "peak at 1 m, Pa", "exposure level, dB", "half of the energy below, Hz",
                 "40 dB below after, s")
    pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
    made = {}
    for case in CASES:
        made[case.title] = sounds(solver, case, rows[case.row])
        for name, sound in made[case.title].items():
            peak, exposure, middle, lasts = levels(sound)
            lines.append(line(case.title, name, f"{peak:.3g}", f"{exposure:.1f}", f"{middle:.0f}", f"{lasts:.2f}"))
        for name, word in ((PAPER, "paper"), (OURS, "carillon")):
            loud = carillon.Sound(made[case.title][name][:, None], RATE_HZ).normalized(0.9)
            loud.save(pathlib.Path(folder) / f"{case.title}_{word}.wav")
    draw(made, picture)
    return lines
