#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""How the modes of four bodies radiate, what that costs, and how well the stated errors hold.

Each part prints a Markdown table:
  fork      levels round a tuning fork, near by and far away
  dense     one mode of each body, solved by sweeps and GMRES, beside its assembled matrix, factorized
  loudness  each body's modes: efficiency, decay by radiation, and by how many dB its pressure at 1 m differs from
            that of the paper's coupling
  errors    every --every-th mode, as computed with --goal, against itself on a surface with edges half as long:
            true and stated errors
  cost      CPU and wall seconds with one thread and with two

What one part has computed is used by the next. `--every 1` compares all modes, which takes long. Of the parts dense
and errors only those modes of a body count whose finer surface has at most --most-vertices.
"""

import functools
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import time
import typing

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / folder) for folder in ("", "decomposition", "truth")]
import bench  # noqa: E402
import bodies  # noqa: E402
import catalogue  # noqa: E402

AIR_DENSITY, SOUND_SPEED = 1.204, 343
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
    begun = time.monotonic()
    report = bench.decompose(build, mesh, folder / name, "--material", material, "--threads", settings.threads,
                             "--band", settings.band, "--transfer", "--transfer-accuracy", settings.goal_db,
                             "--transfer-budget", settings.budget_s)
    report["wall_s"] = time.monotonic() - begun
    return report


def radiate(options, folder, name, goal_db, threads=1):
    return report_of(options.build, folder, name, Settings(goal_db, options.budget, options.band, threads))


def decibels(ratio):
    return 10 * math.log10(ratio)


def loudness(options, folder):
    bench.print_head("body", "mode", "Hz", "efficiency, dB", "against the coupling, dB", "decay by radiation, 1/s",
                     "stated error, dB")
    for name in options.only:
        modes = radiate(options, folder, name, options.goal)["modes"]
        for number, mode in list(enumerate(modes, 1))[::max(1, len(modes) // options.rows)]:
            found = mode["radiation"]
            if not found["computed"]:
                continue
            change = 2 * decibels(found["pressure_at_1m_pa"] / (PASCALS_PER_COUPLING * mode["coupling"]))
            bench.print_row(name, number, f"{mode['frequency_hz']:.0f}", f"{decibels(found['efficiency']):.1f}",
                            f"{change:+.1f}", f"{found['decay_rate_per_s']:.3g}", f"{found['power_error_db']:.2f}")


@functools.cache
def model_of(build, folder, name):
    """A stored model whose modes are exact enough for comparisons with themselves."""
    make, material = BODIES[name]
    mesh, model = folder / f"{name}.obj", folder / f"{name}.model"
    bodies.write_obj(mesh, *make())
    bench.decompose(build, mesh, model, "--material", material, "--accuracy", "5%", "--band", "20:20000")
    return model


@functools.cache
def reference_of(build, folder, name, limits):
    """What tests/radiation_reference finds for a body, with its last four arguments."""
    material = catalogue.read()[BODIES[name][1]]
    speed_ratio = math.sqrt(material.young_pa / material.density_kg_per_m3) / SOUND_SPEED
    command = [build / "tests/radiation_reference", model_of(build, folder, name), speed_ratio, *limits]
    done = subprocess.run([str(word) for word in command], check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout)


def compare(options, folder, name):
    return reference_of(options.build, folder, name,
                        (options.goal, options.budget, options.every, options.most_vertices))


def share(values, bound):
    return f"{100 * sum(value <= bound for value in values) / len(values):.0f} %"


def errors(options, folder):
    bench.print_head("body", "modes compared", "power within 0.5 dB", "95 %, dB", "worst, dB",
                     "directions within 1.5 dB", "worst, dB", "power, worst over stated",
                     "directions, worst over stated", "finer surface too large")
    for name in options.only:
        found = compare(options, folder, name)
        modes = found["checked"]
        if not modes:
            bench.print_row(name, f"0 of {found['computed']}", *[""] * 7, found["too_large"])
            continue
        power = sorted(abs(mode["power_db"]) for mode in modes)
        direction = sorted(mode["direction_db"] for mode in modes)
        over = {kind: max(abs(mode[f"{kind}_db"]) / mode[f"stated_{kind}_db"] for mode in modes)
                for kind in ("power", "direction")}
        bench.print_row(name, f"{len(modes)} of {found['computed']}", share(power, .5),
                        f"{power[int(.95 * len(power))]:.2f}", f"{power[-1]:.2f}", share(direction, 1.5),
                        f"{direction[-1]:.2f}", f"{over['power']:.2f}", f"{over['direction']:.2f}", found["too_large"])


def dense(options, folder):
    bench.print_head("body", "all modes, CPU s", "modes", "vertices", "iterations", "sweeps, CPU s", "assembly, CPU s",
                     "LU, CPU s")
    for name in options.only:
        found = compare(options, folder, name)
        one = found.get("dense")
        if one:
            bench.print_row(name, f"{found['cpu_s']:.1f}", found["computed"], one["vertices"], one["iterations"],
                            f"{one['sweeps_s']:.2f}", f"{one['assembly_s']:.1f}", f"{one['factors_s']:.1f}")


def cost(options, folder):
    bench.print_head("body", "threads", "modes", "radiation, CPU s", "all, wall s")
    for name in options.only:
        for threads in (1, 2):
            report = radiate(options, folder, name, options.goal, threads)
            found = report["radiation"]
            bench.print_row(name, threads, f"{found['modes_computed']} of {found['modes_wanted']}",
                            f"{found['cpu_seconds']:.1f}", f"{report['wall_s']:.1f}")


def fork(options, _folder):
    subprocess.run([options.build / "tests/radiation_fork"], check=True)


PARTS = {"fork": fork, "dense": dense, "loudness": loudness, "errors": errors, "cost": cost}


def main():
    parser = bench.parser(__doc__)
    parser.add_argument("--parts", type=bench.names, default=list(PARTS), help="some of " + ",".join(PARTS))
    parser.add_argument("--only", type=bench.names, default=list(BODIES), help="bodies, by name")
    parser.add_argument("--goal", type=float, default=.5, help="accuracy of the power, dB")
    parser.add_argument("--every", type=int, default=8, help="of how many modes one is compared with a finer surface")
    parser.add_argument("--most-vertices", type=int, default=16000, help="of a finer surface")
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
