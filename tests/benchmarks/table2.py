#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the six wind chimes of O'Brien, Shen, Gatchalian 2002, Table 2, with theory and measurement.

    table2.py CARILLON_PRECOMPUTE [--notes D3,E3]

Every chime goes the way of a user: its surface as an OBJ file through carillon-precompute. Prints a Markdown table of
base frequencies. Exits with 1 where a frequency is off by more than 0.5 % from Timoshenko's beam or from a mesh twice
as fine, or by more than 2 % from the measured column. paper/run.py has the linear elements of the computed column.
"""

import argparse
import math
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "decomposition"))
import bench  # noqa: E402
import bodies  # noqa: E402

# Table 2: ideal Hz, measured length in m and Hz, computed Hz, adjusted length in m and Hz.
CHIMES = {"D3": (587.33, .505, 585.8, 589.17, .5061, 587.40), "E3": (659.26, .475, 656., 665.03, .4770, 659.27),
          "G3": (783.99, .435, 781.8, 787.01, .4366, 784.06), "A4": (880., .410, 877.5, 884.70, .4115, 879.36),
          "B4": (987.77, .388, 982.5, 984.75, .3878, 987.32), "D4": (1174.66, .353, 1167., 1186.88, .3548, 1174.67)}
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
    kappa = 6 * (1 + POISSON) * (1 + m2)**2 / ((7 + 6 * POISSON) * (1 + m2)**2 + (20 + 12 * POISSON) * m2)
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

    high = (4.730040744862704 / length)**2 * math.sqrt(YOUNG_PA * second_moment / (DENSITY * area))
    low = .6 * high
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (middle, high) if equation(middle) < 0 else (low, middle)
    return low / (2 * math.pi)


def solve(build, length, around, along):
    """Base frequency in Hz, number of nodes and CPU seconds."""
    with tempfile.TemporaryDirectory() as folder:
        surface = pathlib.Path(folder, "tube.obj")
        bodies.write_obj(surface, *bodies.tube(length, around, along, OUTER_RADIUS_M, WALL_M))
        report = bench.decompose(build, surface, surface.with_suffix(".model"), "--keep-surface", "--young", YOUNG_PA,
                                 "--poisson", POISSON, "--density", DENSITY, "--band", "20:2500")
    cpu = sum(phase["cpu_seconds"] for phase in report["phases"])
    return report["modes"][0]["frequency_hz"], report["nodes"], cpu


def percent(value, reference):
    return f"{100 * (value / reference - 1):+.2f} %"


def off(value, reference, limit_percent):
    return abs(value / reference - 1) > limit_percent / 100


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--notes", type=bench.names, default=list(CHIMES))
    options = parser.parse_args()
    build = options.program.resolve().parents[1]
    failed = False

    bench.print_head("note", "length m", "Hz (nodes, CPU s)", "Timoshenko Hz", "twice as fine Hz (nodes)",
                     "measured Hz")
    for note in options.notes:
        _, length, measured, *_ = CHIMES[note]
        along = round(length * 100)
        coarse, coarse_nodes, cpu = solve(build, length, 16, along)
        fine, fine_nodes, _ = solve(build, length, 32, 2 * along)
        theory = timoshenko_hz(length)
        failed |= off(coarse, theory, .5) or off(coarse, fine, .5) or off(coarse, measured, 2)
        bench.print_row(note, length, f"{coarse:.2f} ({coarse_nodes}, {cpu:.1f})",
                        f"{theory:.2f} ({percent(coarse, theory)})",
                        f"{fine:.2f} ({fine_nodes}; {percent(coarse, fine)})",
                        f"{measured} ({percent(coarse, measured)})")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
