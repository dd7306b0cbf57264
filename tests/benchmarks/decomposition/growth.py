# SPDX-License-Identifier: Apache-2.0
"""How time and memory grow with the mesh: a tube and a solid, from surface to model."""

import math

import bench
import bodies
import compare

PHASES = ["mesh", "assemble", "factor", "solve", "verify", "write"]


def tube(around, along):
    return lambda: bodies.tube(.505, around, along)


def cube(cells):
    return lambda: bodies.box((.1, .1, .1), (cells,) * 3)


# Surface, nodes asked for, and whether --full alone measures it.
TUBES = [(tube(48, 195), 0, False), (tube(90, 333), 0, False), (tube(144, 520), 0, True),
         (tube(200, 749), 0, True), (tube(255, 955), 1000000, True)]
CUBES = [(cube(20), 9000, False), (cube(27), 20000, False), (cube(43), 80000, True),
         (cube(67), 262000, True)]


def measure(surface, nodes, material, folder, options, environment):
    """The report of carillon-precompute."""
    bodies.write_obj(folder / "surface.obj", *surface())
    young, poisson, density = material
    return bench.decomposed(options.build, folder / "surface.obj", folder / "model", "--element", "linear", "--mass",
                            "lumped", "--keep-surface", "--nodes", nodes, "--young", young, "--poisson", poisson,
                            "--density", density, env=environment)


def print_family(name, sizes, material, folder, options, environment):
    before = None
    for surface, nodes, slow in sizes:
        if slow and not options.full:
            continue
        report = measure(surface, nodes, material, folder, options, environment)
        if "error" in report:
            bench.print_row(name, report["error"]["message"])
            continue
        cpu = {phase["name"]: phase["cpu_seconds"] for phase in report["phases"]}
        total = sum(cpu.values())
        wall = sum(phase["seconds"] for phase in report["phases"])
        exponent = ""
        if before:
            exponent = f"{math.log(total / before[1]) / math.log(report['nodes'] / before[0]):.2f}"
        before = (report["nodes"], total)
        times = [f"{cpu[phase]:.1f}" for phase in PHASES]
        bench.print_row(name, report["nodes"], len(report["modes"]), *times, f"{total:.1f}", f"{wall:.1f}", exponent,
                        f"{report['peak_memory_bytes'] / 2**30:.2f}")


def growth(options, folder, environment):
    bench.print_head("body", "nodes", "modes", *(f"{phase} CPU s" for phase in PHASES), "all CPU s", "wall s",
                     "exponent", "peak GiB")
    for name, sizes, material in (("tube", TUBES, compare.ALUMINIUM), ("cube", CUBES, compare.CERAMIC)):
        if not options.only or name in options.only:
            print_family(name, sizes, material, folder, options, environment)
