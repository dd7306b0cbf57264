# SPDX-License-Identifier: Apache-2.0
"""Carillon beside SLEPc on the same matrices: every mode from 20 Hz to 20 kHz."""

import dataclasses
import json
import math
import pathlib
import subprocess
import sys
from typing import Callable

import bench
import bodies
import solutions

LOW_HZ, HIGH_HZ = 20.0, 20000.0
MAX_RESIDUAL = 1e-6
# Below all eigenvalues and a tenth of the highest frequency away: what suits Carillon suits SLEPc.
SHIFT = -(2 * math.pi * HIGH_HZ / 10)**2
# In SLEPc's own measure, the loosest power of ten with which its modes of all bodies have residuals of at most
# MAX_RESIDUAL.
TOLERANCE = 1e-6
SLEPC = "SLEPc Krylov-Schur, MUMPS"

# Young's modulus in Pa, Poisson's ratio, density in kg/m^3: from Lame's constants in the paper's Table 1.
ALUMINIUM = (6.835179e10, .329801, 2700.)
CERAMIC = (5.454222e9, .330298, 2700.)


@dataclasses.dataclass
class Body:
    name: str
    surface: Callable
    element: str
    mass: str
    material: tuple
    nodes: int = 0
    # Of each program, of which the shortest counts: a second's run is up to a fifth longer on a processor that
    # was idle before.
    runs: int = 1


BODIES = [
    Body("chime", lambda: bodies.tube(.505, 48, 195), "linear", "lumped", ALUMINIUM, runs=3),
    Body("hollow-bunny", lambda: bodies.bunny(.15, .15 / 76, wall=.005), "linear", "lumped", CERAMIC),
    Body("solid-bunny", lambda: bodies.bunny(.15, .15 / 55), "linear", "lumped", CERAMIC, 36000),
    Body("chime-quadratic", lambda: bodies.tube(.505, 24, 120), "quadratic", "consistent", ALUMINIUM),
    Body("bunny-quadratic", lambda: bodies.bunny(.15, .15 / 28), "quadratic", "consistent", CERAMIC,
         4000),
]


def run(command, environment, runs=1):
    """The times that a program prints, of its shortest run, or None where it fails."""
    times = []
    for _ in range(runs):
        done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, env=environment,
                              check=False)
        if done.returncode != 0:
            return None
        times.append(json.loads(done.stdout))
    return min(times, key=lambda time: time["cpu_seconds"])


def make_matrices(body, folder, build, environment):
    vertices, triangles = body.surface()
    bodies.write_obj(folder / "surface.obj", vertices, triangles)
    made = subprocess.run(
        [build / "tests/matrices_benchmark", "make", folder / "surface.obj", folder, body.element,
         body.mass, str(body.nodes), *map(repr, body.material)], env=environment, check=False)
    if made.returncode != 0:
        sys.exit(f"{body.name}: no matrices")


def row(body, label, times, checked, ours):
    ratio = times["cpu_seconds"] / ours["cpu_seconds"]
    spread = abs(checked.frequencies_hz / ours["frequencies_hz"] - 1).max()
    verdict = "" if checked.max_residual <= MAX_RESIDUAL else " (too large)"
    bench.print_row(body.name, label, len(checked.frequencies_hz), f"{times['cpu_seconds']:.2f}", f"{ratio:.1f}",
                    f"{times['seconds']:.2f}", f"{checked.max_residual:.1e}{verdict}",
                    f"{checked.max_orthogonality_error:.0e}", f"{spread:.0e}")


def compare_on(body, folder, options, environment):
    make_matrices(body, folder, options.build, environment)
    K, M = solutions.read_symmetric(folder / "K"), solutions.read_symmetric(folder / "M")
    ours = {}
    for threads in (1, 2):
        times = run([options.build / "tests/matrices_benchmark", "solve", folder, HIGH_HZ, threads],
                    {**environment, "OMP_NUM_THREADS": str(threads),
                     "OPENBLAS_NUM_THREADS": str(threads)}, body.runs)
        if times is None:
            sys.exit(f"{body.name}: Carillon failed")
        checked = solutions.check(folder, K, M, LOW_HZ, HIGH_HZ)
        if not ours:
            ours = {**times, "frequencies_hz": checked.frequencies_hz}
        row(body, f"**Carillon**, {threads} thread{'s' * (threads > 1)}, {K.shape[0]} unknowns", times,
            checked, ours)
    times = run(["/usr/bin/python3", pathlib.Path(__file__).with_name("slepc_peer.py"), folder,
                 len(ours["frequencies_hz"]) + 6, SHIFT, TOLERANCE], environment, body.runs)
    if times is None:
        bench.print_row(body.name, SLEPC, "failed")
        return
    checked = solutions.check(folder, K, M, LOW_HZ, HIGH_HZ)
    if len(checked.frequencies_hz) != len(ours["frequencies_hz"]):
        bench.print_row(body.name, SLEPC, f"{len(checked.frequencies_hz)} modes")
        return
    row(body, SLEPC, times, checked, ours)


def compare(options, folder, environment):
    bench.print_head("body", "program", "modes", "CPU s", "times Carillon's", "wall s", "largest residual",
                     "M-orthogonal to", "frequencies within")
    for body in BODIES:
        if options.only and body.name not in options.only:
            continue
        place = folder / body.name
        place.mkdir()
        compare_on(body, place, options, environment)
