# SPDX-License-Identifier: Apache-2.0
"""Bodies decomposed to an accuracy of 1 %: what each mode's estimated error is, and what its error is against a
much finer mesh of the same surface."""

import dataclasses
import json
import subprocess
import sys
from typing import Callable

import bodies
import numpy

ACCURACY = .01
# Of the nodes: half the grain of a wall, whose error falls by about five.
FINER, MOST_NODES = 4, 150_000
# Below it the finer mesh's own error counts.
SMALLEST_ERROR = 1e-3


@dataclasses.dataclass
class Case:
    name: str
    surface: Callable
    material: str
    solid: bool = False


CASES = [
    Case("chime", lambda: bodies.tube(.505, 24, 120), "chime_aluminum"),
    Case("bowl", lambda: bodies.bowl(.08, .003, 64, 24), "bowl_metal"),
    Case("plate", lambda: bodies.box((.3, .2, .003), (1, 1, 1)), "structural_steel"),
    Case("bunny", lambda: bodies.bunny(.15, .15 / 28), "bunny_ceramic", solid=True),
    Case("bell", bodies.bell, "bell_bronze"),
]


def decompose(surface, material, options, environment, *more):
    """The report of one run: its modes, its nodes and its CPU seconds."""
    run = subprocess.run(
        [options.build / "bin/carillon-precompute", surface, "--out", surface.with_suffix(".model"),
         "--material", material, "--threads", "1", "--json", *more],
        stdout=subprocess.PIPE, env=environment, check=False)
    report = json.loads(run.stdout)
    if run.returncode != 0:
        sys.exit(f"{surface}: {report['error']['message']}")
    report["cpu_seconds"] = sum(phase["cpu_seconds"] for phase in report["phases"])
    return report


def column(report, name):
    return numpy.array([mode[name] for mode in report["modes"]])


def errors(report, finer):
    """Estimated and true, of the modes that both have."""
    count = min(len(report["modes"]), len(finer["modes"]))
    true = column(report, "frequency_hz")[:count] / column(finer, "frequency_hz")[:count] - 1
    return column(report, "estimated_error")[:count], true


def draw(found, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(figsize=(7, 6))
    for name, (estimated, true) in found.items():
        axes.loglog(numpy.maximum(true, 1e-6), estimated, ".", label=name)
    axes.plot([1e-6, 1e-1], [1e-6, 1e-1], "k-", linewidth=.5)
    axes.set(xlabel="error against a much finer mesh", ylabel="estimated error",
             title=f"Every mode to 20 kHz, {100 * ACCURACY:g} % asked for")
    axes.grid(alpha=.3)
    axes.legend()
    figure.savefig(path, dpi=110)


def accuracy(options, folder, environment):
    print("| body | nodes | modes | CPU s | largest estimated error | largest true error | estimated over true: "
          "least, median, most | nodes of the finer mesh |\n" + "| --- " * 8 + "|", flush=True)
    found = {}
    for case in CASES:
        if options.only and case.name not in options.only:
            continue
        surface = folder / f"{case.name}.obj"
        bodies.write_obj(surface, *case.surface())
        report = decompose(surface, case.material, options, environment, "--accuracy", str(ACCURACY))
        nodes = min(FINER * report["nodes"], MOST_NODES) if case.solid else FINER * report["nodes"]
        corners = int(nodes / (7.5 if case.solid else 6))
        finer = decompose(surface, case.material, options, environment, "--nodes", str(corners))
        estimated, true = found[case.name] = errors(report, finer)
        told = estimated[true > SMALLEST_ERROR] / true[true > SMALLEST_ERROR]
        ratios = ", ".join(f"{x:.2f}" for x in (told.min(), numpy.median(told), told.max())) if len(told) else "-"
        print(f"| {case.name} | {report['nodes']} | {len(report['modes'])} | {report['cpu_seconds']:.1f} "
              f"| {100 * estimated.max():.2f} % | {100 * true.max():.2f} % | {ratios} | {finer['nodes']} |",
              flush=True)
    if options.picture:
        draw(found, options.picture)
