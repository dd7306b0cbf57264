# SPDX-License-Identifier: Apache-2.0
"""The rows of the paper's Table 1, with shapes of our own where the paper gives none, and how they are computed."""

import dataclasses
import math
import sys
from typing import Callable

import bench
import bodies
import numpy
import scene_makers

CHIME_M = .5061  # Table 1 has the frequency of the tuned D3 of Table 2
SHELF_M = (.6, .15, .02)
BUNNY_M, BUNNY_WALL_M = .15, .008
BOWL_M, BOWL_WALL_M = .1, .012
WALL_SHARE = .05  # of blocks and boxes, as in the paper


def hollow_cube(side, cells):
    """Both walls as (vertices, triangles)."""
    wall = WALL_SHARE * side
    outer, faces = bodies.box((side,) * 3, (cells,) * 3)
    inner, inner_faces = bodies.box((side - 2 * wall,) * 3, (cells,) * 3)
    return (numpy.concatenate([outer, inner + wall]),
            numpy.concatenate([faces, numpy.array(inner_faces)[:, ::-1] + len(outer)]))


def bowl(around, down):
    return bodies.bowl(BOWL_M, BOWL_WALL_M, around, down)


def letter():
    return scene_makers.letter_mesh("T")


@dataclasses.dataclass
class Material:
    """Lame's constants in Pa, Rayleigh's in s and 1/s, density in kg/m^3."""
    lame_lambda: float
    lame_mu: float
    alpha1: float
    alpha2: float
    density: float

    @property
    def poisson(self):
        return self.lame_lambda / (2 * (self.lame_lambda + self.lame_mu))

    @property
    def young_pa(self):
        return 2 * self.lame_mu * (1 + self.poisson)

    def decay_per_s(self, damped_hz):
        """Decay rate of a mode from its damped frequency: Lambda = omega_d^2 + sigma^2, solved by iteration."""
        sigma = 0.0
        for _ in range(100):
            eigenvalue = (2 * math.pi * damped_hz)**2 + sigma**2
            sigma = (self.alpha1 * eigenvalue + self.alpha2) / 2
        return sigma

    def natural_hz(self, damped_hz):
        return math.hypot(damped_hz, self.decay_per_s(damped_hz) / (2 * math.pi))

    def figures(self):
        """Fields of the contract's Material."""
        return {"young_pa": self.young_pa, "poisson_ratio": self.poisson, "density_kg_per_m3": self.density,
                "alpha1_s": self.alpha1, "alpha2_per_s": self.alpha2}

    def options(self):
        figures = {"--young": self.young_pa, "--poisson": self.poisson, "--density": self.density,
                   "--alpha1": self.alpha1, "--alpha2": self.alpha2}
        return [str(word) for pair in figures.items() for word in pair]


@dataclasses.dataclass
class Printed:
    """A row of the paper's Table 1."""
    damped_hz: float
    decay_per_s: float
    nodes: int
    method: str
    seconds: float


@dataclasses.dataclass
class Row:
    """`coarse` has about the paper's number of nodes with linear elements; `fine` is for quadratic ones. `shape`: rows
    that share it have one name. `highest_hz`: of the band of the fine one. `options`: of both, except
    `--keep-surface`, which the coarse one always has."""
    name: str
    shape: str
    material: Material
    printed: Printed
    coarse: Callable
    fine: Callable
    highest_hz: float
    options: tuple = ("--keep-surface",)

    @property
    def natural_hz(self):
        """The natural frequency that belongs to the printed one."""
        return self.material.natural_hz(self.printed.damped_hz)


@dataclasses.dataclass
class Solved:
    nodes: int
    elements: int
    modes: list
    cpu_s: float
    residual: float

    @property
    def base(self):
        return self.modes[0]

    @property
    def natural_hz(self):
        return self.base["frequency_hz"]

    @property
    def decay_per_s(self):
        return self.base["decay_rate_per_s"]


def cube_row(name, side, highest_hz, printed):
    wood = Material(5e8, 1e8, 8e-6, 50, 550)
    return Row(name, "hollow cube", wood, printed, lambda: hollow_cube(side, 10), lambda: hollow_cube(side, 20),
               highest_hz)


def shelf_row(name, material, damped_hz, decay_per_s):
    printed = Printed(damped_hz, decay_per_s, 361, "sparse", 30)
    return Row(name, "shelf", material, printed, lambda: bodies.box(SHELF_M, (17, 9, 1)),
               lambda: bodies.box(SHELF_M, (30, 8, 2)), 2000, ("--keep-surface", "--fix", "plane:0,0,0/0,1,0"))


def bunny_row(name, material):
    printed = Printed(855.9, 19.5, 37114, "sparse", 16800)
    return Row(name, "bunny", material, printed, lambda: bodies.bunny(BUNNY_M, BUNNY_M / 71, BUNNY_WALL_M),
               lambda: bodies.bunny(BUNNY_M, BUNNY_M / 30, BUNNY_WALL_M), 6000, ())


def bowl_row(name, material, damped_hz, decay_per_s):
    return Row(name, "bowl", material, Printed(damped_hz, decay_per_s, 387, "dense", 252), lambda: bowl(24, 8),
               lambda: bowl(40, 14), 3000)


def table1():
    return [
        Row("chime (D3)", "chime", Material(4.98e10, 2.57e10, 1e-7, 0, 2700), Printed(587.4, .6, 18796, "sparse", 8640),
            lambda: bodies.tube(CHIME_M, 48, 195), lambda: bodies.tube(CHIME_M, 16, 51), 2500),
        bowl_row("bowl 1", Material(4.98e9, 2.57e9, 1e-7, 30, 2700), 551.3, 15.6),
        bowl_row("bowl 2", Material(5e8, 1e8, 8e-6, 30, 750), 216.7, 22.4),
        bunny_row("bunny (ceramic)", Material(3.99e9, 2.05e9, 1e-6, 10, 2700)),
        shelf_row("shelf (plastic)", Material(2.49e10, 1.28e10, 1e-6, 50, 2700), 488.9, 29.7),
        shelf_row("shelf (aluminum)", Material(4.98e10, 2.56e10, 1e-7, 0, 2700), 691.5, .9),
        shelf_row("shelf (wood)", Material(5e8, 1e8, 8e-6, 50, 750), 154.6, 28.8),
        bunny_row("bunny (metal)", Material(4.99e10, 2.56e10, 1e-7, 0, 2700)),
        cube_row("blocks", .05, 10000, Printed(1596.2, 428.1, 1160, "dense", 19680)),
        cube_row("boxes", .5, 1000, Printed(159.1, 49., 1160, "dense", 19680)),
        Row("the end (T)", "letter T", Material(1.49e9, 7.7e8, 2e-7, 30, 2700), Printed(247.7, 15.2, 71, "dense", 42),
            letter, letter, 4000, ()),
    ]


class Solver:
    """carillon-precompute, in a folder for its files."""

    def __init__(self, build, folder):
        self.build, self.folder = build, folder

    def solve(self, surface, name, options):
        """Decomposes (vertices, triangles); leaves NAME.model in the folder."""
        path = self.folder / f"{name}.obj"
        bodies.write_obj(path, *surface)
        report = bench.decompose(self.build, path, self.folder / f"{name}.model", *options)
        solved = Solved(report["nodes"], report["elements"], report["modes"],
                        sum(phase["cpu_seconds"] for phase in report["phases"]),
                        max(mode["residual"] for mode in report["modes"]))
        print(f"{name}: {solved.nodes} nodes, {len(solved.modes)} modes, {solved.natural_hz:.2f} Hz, "
              f"{solved.cpu_s:.2f} CPU s", file=sys.stderr, flush=True)
        return solved

    def as_in_paper(self, row):
        """Linear elements, the paper's mass (consistent for its dense method, lumped for its sparse one), each mode
        to 20 kHz."""
        mass = {"dense": "consistent", "sparse": "lumped"}[row.printed.method]
        options = [word for word in row.options if word != "--keep-surface"]
        return self.solve(row.coarse(), row.name + ", linear",
                          [*options, "--keep-surface", "--element", "linear", "--mass", mass, "--band", "20:20000",
                           *row.material.options()])

    def best(self, row):
        """Quadratic elements, consistent mass, the lowest modes."""
        return self.solve(row.fine(), row.name,
                          [*row.options, "--band", f"20:{row.highest_hz:g}", *row.material.options()])
