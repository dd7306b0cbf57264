# SPDX-License-Identifier: Apache-2.0
"""The sizes of O'Brien, Shen, Gatchalian 2002, Table 1, from surface to model, beside the paper's times.

The paper gives the number of nodes, the material and the time; its shapes are not public, so bodies of the same
kind and number of nodes stand in. As in the paper: linear elements, lumped mass, every mode to 20 kHz.
"""

import dataclasses
import json
import subprocess
import sys
from typing import Callable

import bodies


@dataclasses.dataclass
class Row:
    """Lame's constants in Pa, density in kg/m^3, the paper's nodes, method and seconds."""
    name: str
    surface: Callable
    lame_lambda: float
    lame_mu: float
    density: float
    nodes: int
    method: str
    seconds: float


def shelf():
    return bodies.box((.8, .25, .02), (17, 9, 1))


def bunny():
    return bodies.bunny(.15, .15 / 55)


def bowl():
    return bodies.bowl(.1, .004, 21, 8)


ROWS = [
    Row("chime", lambda: bodies.tube(.505, 48, 195), 4.98e10, 2.57e10, 2700, 18796, "sparse", 8640),
    Row("bowl 1", bowl, 4.98e9, 2.57e9, 2700, 387, "dense", 252),
    Row("bowl 2", bowl, 5e8, 1e8, 750, 387, "dense", 252),
    Row("bunny (ceramic)", bunny, 3.99e9, 2.05e9, 2700, 37114, "sparse", 16800),
    Row("shelf (plastic)", shelf, 2.49e10, 1.28e10, 2700, 361, "sparse", 30),
    Row("shelf (aluminum)", shelf, 4.98e10, 2.56e10, 2700, 361, "sparse", 30),
    Row("shelf (wood)", shelf, 5e8, 1e8, 750, 361, "sparse", 30),
    Row("bunny (metal)", bunny, 4.99e10, 2.56e10, 2700, 37114, "sparse", 16800),
    Row("blocks, boxes", lambda: bodies.box((.1, .1, .1), (9, 9, 9)), 5e8, 1e8, 550, 1160, "dense", 19680),
    Row("the end: T", lambda: bodies.box((.3, .08, .04), (11, 2, 1)), 1.49e9, 7.7e8, 2700, 71, "dense", 42),
]


def print_row(row, folder, options, environment):
    vertices, triangles = row.surface()
    bodies.write_obj(folder / "surface.obj", vertices, triangles)
    run = subprocess.run(
        [options.build / "bin/carillon-precompute", folder / "surface.obj", "--out", folder / "model",
         "--json", "--element", "linear", "--mass", "lumped", "--keep-surface", "--nodes", str(row.nodes),
         "--lame-lambda", str(row.lame_lambda), "--lame-mu", str(row.lame_mu),
         "--density", str(row.density)],
        stdout=subprocess.PIPE, env=environment, check=False)
    report = json.loads(run.stdout)
    if run.returncode != 0:
        sys.exit(f"{row.name}: {report['error']}")
    wall = sum(phase["seconds"] for phase in report["phases"])
    cpu = sum(phase["cpu_seconds"] for phase in report["phases"])
    print(f"| {row.name} | {row.nodes} | {report['nodes']} | {len(report['modes'])} | {row.method} "
          f"| {row.seconds:.0f} | {wall:.2f} | {cpu:.2f} | {row.seconds / wall:.0f} |", flush=True)


def table1(options, folder, environment):
    print("| row | nodes, paper | nodes | modes | method, paper | paper s | Carillon s | CPU s "
          "| times faster |\n" + "| --- " * 9 + "|", flush=True)
    for row in ROWS:
        if not options.only or row.name in options.only:
            print_row(row, folder, options, environment)
