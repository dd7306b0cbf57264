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
# Times the nodes, the first for which memory suffices: 4 is half the element size in a wall, which divides its error
# by about five.
FINER, MOST_NODES = (4, 3, 2), 150_000
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
    Case("bowl", lambda: bodies.bowl(.08, .003, 64, 24), "structural_steel"),
    Case("plate", lambda: bodies.box((.3, .2, .003), (1, 1, 1)), "structural_steel"),
    Case("bunny", lambda: bodies.bunny(.15, .15 / 28), "bunny_ceramic", solid=True),
    Case("bell", bodies.bell, "bell_bronze"),
]


class Refused(Exception):
    """A reason, and a message."""


def decompose(surface, material, options, environment, *more):
    """The report of one run: its modes, its nodes and its CPU seconds."""
    run = subprocess.run(
        [options.build / "bin/carillon-precompute", surface, "--out", surface.with_suffix(".model"),
         "--material", material, "--threads", "1", "--json", *more],
        stdout=subprocess.PIPE, env=environment, check=False)
    report = json.loads(run.stdout)
    if run.returncode != 0:
        raise Refused(report["error"]["reason"], f"{surface}: {report['error']['message']}")
    report["cpu_seconds"] = sum(phase["cpu_seconds"] for phase in report["phases"])
    return report


def decompose_finer(case, surface, nodes, options, environment):
    """The report of a mesh with so many times `nodes` as memory allows."""
    for finer in FINER:
        most = min(finer * nodes, MOST_NODES) if case.solid else finer * nodes
        corners = int(most / (7.5 if case.solid else 6))
        try:
            return decompose(surface, case.material, options, environment, "--nodes", str(corners))
        except Refused as refused:
            if refused.args[0] != "MEMORY_TOO_SMALL":
                raise
    sys.exit(f"{surface}: memory does not suffice for a mesh {FINER[-1]} times as fine")


def column(report, name):
    return numpy.array([mode[name] for mode in report["modes"]])


def errors(report, finer):
    """Estimated and true, of the modes that both have. Modes of different errors may swap places, so they are paired
    in the order of what the estimate makes of them."""
    frequency, estimated = column(report, "frequency_hz"), column(report, "estimated_error")
    order = numpy.argsort(frequency / (1 + estimated))[:len(finer["modes"])]
    true = frequency[order] / column(finer, "frequency_hz")[:len(order)] - 1
    return estimated[order], true


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
        finer = decompose_finer(case, surface, report["nodes"], options, environment)
        estimated, true = found[case.name] = errors(report, finer)
        told = estimated[true > SMALLEST_ERROR] / true[true > SMALLEST_ERROR]
        ratios = ", ".join(f"{x:.2f}" for x in (told.min(), numpy.median(told), told.max())) if len(told) else "-"
        print(f"| {case.name} | {report['nodes']} | {len(report['modes'])} | {report['cpu_seconds']:.1f} "
              f"| {100 * estimated.max():.2f} % | {100 * true.max():.2f} % | {ratios} | {finer['nodes']} |",
              flush=True)
    if options.picture:
        draw(found, options.picture)
