#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""How the modes of four bodies radiate, what that costs, and how well the stated errors hold.

Each part prints a Markdown table:
  exact     spheres of every order to 6 against the closed form
  dense     the equation solved by sweeps and GMRES beside its assembled matrix, factorized
  loudness  each body's modes: efficiency, decay by radiation, and by how many dB its pressure at 1 m differs from
            that of the paper's coupling
  errors    modes solved to --goal against the same to --reference: true and stated errors, of those modes that were
            then solved on surfaces at least twice as fine
  cost      CPU and wall seconds with one thread and with two

What one part has computed is used by the next. A reference takes long: --band chooses some of the modes.
"""

import argparse
import functools
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import time
import typing

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "decomposition"))
import bodies  # noqa: E402

AIR_DENSITY = 1.204
PASCALS_PER_COUPLING = AIR_DENSITY * 2 * math.pi * 1000 / (4 * math.pi)  # server/synthesis/bank/level.h

BODIES = {"chime": (lambda: bodies.tube(.403, 24, 64), "chime_aluminum"),
          "bowl": (lambda: bodies.bowl(.1, .004, 48, 16), "porcelain"),
          "bell": (lambda: bodies.bell(32), "bell_bronze"),
          "bunny": (lambda: bodies.bunny(.15, .003, .004), "porcelain")}


class Settings(typing.NamedTuple):
    goal_db: float
    budget_s: float
    band: str
    threads: int


@functools.cache
def report_of(build, folder, name, settings):
    """What carillon-precompute reports of a body, and the wall seconds that it took."""
    make, material = BODIES[name]
    mesh = folder / f"{name}.obj"
    if not mesh.exists():
        bodies.write_obj(mesh, *make())
    command = [build / "bin/carillon-precompute", mesh, "--out", folder / name, "--material", material, "--json",
               "--threads", settings.threads, "--band", settings.band, "--transfer", "--transfer-accuracy",
               settings.goal_db, "--transfer-budget", settings.budget_s]
    begun = time.monotonic()
    done = subprocess.run([str(word) for word in command], check=True, stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL)
    report = json.loads(done.stdout)
    report["wall_s"] = time.monotonic() - begun
    return report


def radiate(options, folder, name, goal_db, threads=1):
    return report_of(options.build, folder, name, Settings(goal_db, options.budget, options.band, threads))


def decibels(ratio):
    return 10 * math.log10(ratio)


def loudness(options, folder):
    print("| body | mode | Hz | efficiency, dB | against the coupling, dB | decay by radiation, 1/s | "
          "stated error, dB |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name in options.only:
        modes = radiate(options, folder, name, options.goal)["modes"]
        for number, mode in list(enumerate(modes, 1))[::max(1, len(modes) // options.rows)]:
            found = mode["radiation"]
            if not found["computed"]:
                continue
            change = 2 * decibels(found["pressure_at_1m_pa"] / (PASCALS_PER_COUPLING * mode["coupling"]))
            print(f"| {name} | {number} | {mode['frequency_hz']:.0f} | {decibels(found['efficiency']):.1f} | "
                  f"{change:+.1f} | {found['decay_rate_per_s']:.3g} | {found['power_error_db']:.2f} |", flush=True)


def errors(options, folder):
    print("| body | modes on surfaces twice as fine | median, dB | 95 %, dB | worst, dB | worst over stated |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name in options.only:
        coarse = radiate(options, folder, name, options.goal)["modes"]
        fine = radiate(options, folder, name, options.reference)["modes"]
        pairs = [(a["radiation"], b["radiation"]) for a, b in zip(coarse, fine)]
        pairs = [(a, b) for a, b in pairs if a["computed"] and b["computed"] and 1.9 * b["edge_m"] < a["edge_m"]]
        off = [(abs(2 * decibels(a["pressure_at_1m_pa"] / b["pressure_at_1m_pa"])), a["power_error_db"])
               for a, b in pairs]
        if not off:
            print(f"| {name} | 0 | | | | |")
            continue
        true = sorted(error for error, _ in off)
        print(f"| {name} | {len(off)} of {len(coarse)} | {true[len(true) // 2]:.2f} | "
              f"{true[int(.95 * len(true))]:.2f} | {true[-1]:.2f} | "
              f"{max(error / stated for error, stated in off):.2f} |", flush=True)


def cost(options, folder):
    print("| body | threads | modes | radiation, CPU s | all, wall s |")
    print("| --- | --- | --- | --- | --- |")
    for name in options.only:
        for threads in (1, 2):
            report = radiate(options, folder, name, options.goal, threads)
            found = report["radiation"]
            print(f"| {name} | {threads} | {found['modes_computed']} of {found['modes_wanted']} | "
                  f"{found['cpu_seconds']:.1f} | {report['wall_s']:.1f} |", flush=True)


def spheres(part):
    def run(options, _):
        subprocess.run([options.build / "tests/radiation_spheres", part], check=True)
    return run


PARTS = {"exact": spheres("exact"), "dense": spheres("dense"), "loudness": loudness, "errors": errors, "cost": cost}


def names(text):
    return text.split(",")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True, help="the release build's folder")
    parser.add_argument("--parts", type=names, default=list(PARTS), help="some of " + ",".join(PARTS))
    parser.add_argument("--only", type=names, default=list(BODIES), help="bodies, by name")
    parser.add_argument("--goal", type=float, default=.5, help="accuracy of the power, dB")
    parser.add_argument("--reference", type=float, default=.1, help="accuracy of what it is compared with, dB")
    parser.add_argument("--budget", type=float, default=600, help="CPU seconds for one body")
    parser.add_argument("--band", default="20:20000", help="of the modes, Hz")
    parser.add_argument("--rows", type=int, default=12, help="modes to print of each body")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for part in options.parts:
            print(f"\n## {part}\n", flush=True)
            PARTS[part](options, pathlib.Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
