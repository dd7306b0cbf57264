#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the six wind chimes of O'Brien, Shen, Gatchalian 2002, Table 2, with theory and measurement.

    table2.py CARILLON_PRECOMPUTE [--notes D3,E3] [--quadratic-only]

Every chime goes the way of a user: its surface as an OBJ file through carillon-precompute. Prints a
Markdown table of base frequencies. Exits with 1 where a
frequency with quadratic elements is off by more than 0.5 % from Timoshenko's beam or from a mesh twice
as fine, or by more than 2 % from the measured column, or where one with linear elements at about the
paper's number of nodes is off by more than 1.5 % from the computed column.
"""

import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

# Table 2: note, measured length in m, measured and computed base frequency in Hz.
CHIMES = [("D3", .505, 585.8, 589.17), ("E3", .475, 656.0, 665.03), ("G3", .435, 781.8, 787.01),
          ("A4", .410, 877.5, 884.70), ("B4", .388, 982.5, 984.75), ("D4", .353, 1167.0, 1186.88)]
OUTER_RADIUS_M, WALL_M = .0125, .001
LAMBDA_PA, MU_PA, DENSITY = 4.98e10, 2.57e10, 2700.
YOUNG_PA = MU_PA * (3 * LAMBDA_PA + 2 * MU_PA) / (LAMBDA_PA + MU_PA)
POISSON = LAMBDA_PA / (2 * (LAMBDA_PA + MU_PA))


def timoshenko_hz(length):
    """The lowest bending mode of the free tube by Timoshenko's full frequency equation, with Cowper's
    shear coefficient for a hollow circle."""
    inner = OUTER_RADIUS_M - WALL_M
    area = math.pi * (OUTER_RADIUS_M**2 - inner**2)
    second_moment = math.pi / 4 * (OUTER_RADIUS_M**4 - inner**4)
    m2 = (inner / OUTER_RADIUS_M)**2
    kappa = 6 * (1 + POISSON) * (1 + m2)**2 / (
        (7 + 6 * POISSON) * (1 + m2)**2 + (20 + 12 * POISSON) * m2)
    shear = kappa * MU_PA

    def equation(omega):
        inertia = DENSITY * omega**2
        p = inertia / YOUNG_PA * (1 + YOUNG_PA / shear)
        r = inertia * area / (YOUNG_PA * second_moment) - inertia**2 / (YOUNG_PA * shear)
        root = math.sqrt(p * p + 4 * r)
        alpha, beta = math.sqrt((root - p) / 2), math.sqrt((root + p) / 2)
        q = inertia / shear
        return ((alpha**2 + q) * math.tan(beta * length / 2) / beta
                + (beta**2 - q) * math.tanh(alpha * length / 2) / alpha)

    high = (4.730040744862704 / length)**2 * math.sqrt(
        YOUNG_PA * second_moment / (DENSITY * area))
    low = .6 * high
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (middle, high) if equation(middle) < 0 else (low, middle)
    return low / (2 * math.pi)


def write_tube(path, length, around, along):
    """The closed surface of the tube; its polygons have the areas of the circles they stand for, since
    one inscribed in the circle would be a smaller tube."""
    scale = math.sqrt(2 * math.pi / around / math.sin(2 * math.pi / around))
    outer, inner = OUTER_RADIUS_M * scale, (OUTER_RADIUS_M - WALL_M) * scale
    lines = []
    for radius in (outer, inner):
        for k in range(along + 1):
            for i in range(around):
                angle = 2 * math.pi * i / around
                lines.append(f"v {radius * math.cos(angle):.15g} {radius * math.sin(angle):.15g} "
                             f"{length * k / along:.15g}")

    def vertex(wall, k, i):
        return wall * (along + 1) * around + k * around + i % around + 1

    def quad(a, b, c, d):
        lines.append(f"f {a} {b} {c}")
        lines.append(f"f {a} {c} {d}")

    for i in range(around):
        for k in range(along):
            quad(vertex(0, k, i), vertex(0, k, i + 1), vertex(0, k + 1, i + 1), vertex(0, k + 1, i))
            quad(vertex(1, k, i), vertex(1, k + 1, i), vertex(1, k + 1, i + 1), vertex(1, k, i + 1))
        quad(vertex(0, 0, i), vertex(1, 0, i), vertex(1, 0, i + 1), vertex(0, 0, i + 1))
        quad(vertex(0, along, i), vertex(0, along, i + 1), vertex(1, along, i + 1),
             vertex(1, along, i))
    path.write_text("\n".join(lines) + "\n")


def solve(program, length, element, around, along):
    """Base frequency in Hz, number of nodes and CPU seconds."""
    with tempfile.TemporaryDirectory() as folder:
        surface = pathlib.Path(folder, "tube.obj")
        write_tube(surface, length, around, along)
        run = subprocess.run(
            [program, str(surface), "--out", str(pathlib.Path(folder, "tube.modes")), "--json",
             "--element", element, "--keep-surface", "--young", str(YOUNG_PA), "--poisson", str(POISSON),
             "--density", str(DENSITY), "--band", "20:2500"],
            stdout=subprocess.PIPE, check=False)
    report = json.loads(run.stdout)
    if run.returncode != 0:
        sys.exit(f"{report['error']}")
    cpu = sum(phase["cpu_seconds"] for phase in report["phases"])
    return report["modes"][0]["frequency_hz"], report["nodes"], cpu


def percent(value, reference):
    return f"{100 * (value / reference - 1):+.2f} %"


def off(value, reference, limit_percent):
    return abs(value / reference - 1) > limit_percent / 100


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--notes", default="D3,E3,G3,A4,B4,D4")
    parser.add_argument("--quadratic-only", action="store_true")
    options = parser.parse_args()
    chimes = [chime for chime in CHIMES if chime[0] in options.notes.split(",")]
    failed = False

    print("| note | length m | quadratic Hz (nodes, CPU s) | Timoshenko Hz | twice as fine Hz (nodes) "
          "| measured Hz |")
    print("| --- | --- | --- | --- | --- | --- |")
    for note, length, measured, _ in chimes:
        along = round(length * 100)
        coarse, coarse_nodes, cpu = solve(options.program, length, "quadratic", 16, along)
        fine, fine_nodes, _ = solve(options.program, length, "quadratic", 32, 2 * along)
        theory = timoshenko_hz(length)
        failed |= off(coarse, theory, .5) or off(coarse, fine, .5) or off(coarse, measured, 2)
        print(f"| {note} | {length} | {coarse:.2f} ({coarse_nodes}, {cpu:.1f}) "
              f"| {theory:.2f} ({percent(coarse, theory)}) "
              f"| {fine:.2f} ({fine_nodes}; {percent(coarse, fine)}) "
              f"| {measured} ({percent(coarse, measured)}) |", flush=True)
    if not options.quadratic_only:
        print("\n| note | linear Hz (nodes, CPU s) | computed in the paper Hz |\n| --- | --- | --- |")
        for note, length, _, computed in chimes:
            linear, nodes, cpu = solve(options.program, length, "linear", 48, 195)
            failed |= off(linear, computed, 1.5)
            print(f"| {note} | {linear:.2f} ({nodes}, {cpu:.1f}) "
                  f"| {computed} ({percent(linear, computed)}) |", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
