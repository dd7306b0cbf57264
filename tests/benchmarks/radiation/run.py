#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""How well the stated errors of the radiation of four bodies hold, as a Markdown table.

Every --every-th mode, as computed with --goal, is compared with itself on a surface with edges half as long, if that
surface has at most --most-vertices: true and stated errors. `--every 1` compares all modes, which takes long.
"""

import json
import math
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / folder) for folder in ("", "decomposition", "truth")]
import bench  # noqa: E402
import bodies  # noqa: E402
import catalogue  # noqa: E402

SOUND_SPEED = 343

BODIES = {"chime": (lambda: bodies.tube(.403, 24, 64), "chime_aluminum"),
          "bowl": (lambda: bodies.bowl(.1, .004, 48, 16), "porcelain"),
          "bell": (lambda: bodies.bell(32), "bell_bronze"),
          "bunny": (lambda: bodies.bunny(.15, .003, .004), "porcelain")}


def model_of(build, folder, name):
    """A stored model whose modes are exact enough for comparisons with themselves."""
    make, material = BODIES[name]
    mesh, model = folder / f"{name}.obj", folder / f"{name}.model"
    bodies.write_obj(mesh, *make())
    bench.decompose(build, mesh, model, "--material", material, "--accuracy", "5%", "--band", "20:20000")
    return model


def compare(options, folder, name):
    """What tests/radiation_reference finds for a body."""
    material = catalogue.read()[BODIES[name][1]]
    speed_ratio = math.sqrt(material.young_pa / material.density_kg_per_m3) / SOUND_SPEED
    command = [options.build / "tests/radiation_reference", model_of(options.build, folder, name), speed_ratio,
               options.goal, options.budget, options.every, options.most_vertices]
    done = subprocess.run([str(word) for word in command], check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout)


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


def main():
    parser = bench.parser(__doc__)
    parser.add_argument("--only", type=bench.names, default=list(BODIES), help="bodies, by name")
    parser.add_argument("--goal", type=float, default=.5, help="accuracy of the power, dB")
    parser.add_argument("--every", type=int, default=8, help="of how many modes one is compared with a finer surface")
    parser.add_argument("--most-vertices", type=int, default=16000, help="of a finer surface")
    parser.add_argument("--budget", type=float, default=600, help="CPU seconds for one body")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        errors(options, pathlib.Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
