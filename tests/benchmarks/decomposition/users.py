# SPDX-License-Identifier: Apache-2.0
"""Bodies as users have them, with the defaults: verdict, cost, and the stated and true errors of the frequencies."""

import dataclasses
import math
import pathlib
from typing import Callable

import bench
import bodies
import measured
import numpy

MODELS = pathlib.Path("/usr/share/assimp/models")
MOST_SECONDS = 300
# Times the nodes of the mesh that the frequencies are compared with, and the most nodes it may have; without --full
# only small bodies are compared.
FINER, MOST_NODES, MOST_NODES_QUICK = 4, 400_000, 60_000
NODES_PER_CORNER = 7


def torus(radius, thickness, around=48, across=16):
    angles = [2 * math.pi * k / across for k in range(across)]
    return bodies.lathe([(radius + thickness * math.cos(a), thickness * math.sin(a)) for a in angles], around)


def ball(radius, around=48, along=24):
    angles = [math.pi * k / along for k in range(along + 1)]
    return bodies.lathe([(radius * abs(round(math.sin(a), 12)), -radius * math.cos(a)) for a in angles], around)


def prism(outline, height):
    """A star-shaped outline of (x, y), counter-clockwise about the origin, drawn up by `height`."""
    count = len(outline)
    vertices = [(x, y, z) for z in (0, height) for x, y in outline] + [(0, 0, 0), (0, 0, height)]
    triangles = []
    for i in range(count):
        j = (i + 1) % count
        triangles += [(i, j, count + j), (i, count + j, count + i), (j, i, 2 * count),
                      (count + i, count + j, 2 * count + 1)]
    return numpy.array(vertices), triangles


def gear(teeth=16, inner=.018, outer=.022, height=.006):
    outline = []
    for k in range(4 * teeth):
        radius, angle = (outer if k % 4 in (1, 2) else inner), 2 * math.pi * k / (4 * teeth)
        outline.append((radius * math.cos(angle), radius * math.sin(angle)))
    return prism(outline, height)


def spring(turns=4, radius=.01, wire=.0012, across=10, along=160):
    """A helix of round wire, closed at both ends by its centres."""
    vertices, pitch = [], 3 * wire
    for k in range(along + 1):
        angle = 2 * math.pi * turns * k / along
        outward = numpy.array([math.cos(angle), math.sin(angle), 0])
        for i in range(across):
            turn = 2 * math.pi * i / across
            vertices.append(outward * (radius + wire * math.cos(turn))
                            + [0, 0, pitch * angle / (2 * math.pi) + wire * math.sin(turn)])
    triangles = []
    for k in range(along):
        for i in range(across):
            a, b = k * across + i, k * across + (i + 1) % across
            triangles += [(a, b + across, b), (a, a + across, b + across)]
    for start, flip in ((0, False), (along * across, True)):
        vertices.append(numpy.mean(vertices[start:start + across], axis=0))
        for i in range(across):
            a, b = start + i, start + (i + 1) % across
            triangles.append((b, a, len(vertices) - 1) if flip else (a, b, len(vertices) - 1))
    return numpy.array(vertices), triangles


@dataclasses.dataclass
class Body:
    name: str
    source: Callable | pathlib.Path
    material: str = "structural_steel"
    arguments: tuple = ()


def block(*size):
    return lambda: bodies.box(size, (1, 1, 1))


BODIES = [
    Body("bell", bodies.bell, "bell_bronze"),
    Body("bowl 160 x 3 mm", lambda: bodies.bowl(.08, .003, 64, 24)),
    Body("chime 505 mm", lambda: bodies.tube(.505, 24, 120), "chime_aluminum"),
    Body("plate 300 x 200 x 3 mm", block(.3, .2, .003)),
    Body("plate 300 x 200 x 1 mm", block(.3, .2, .001)),
    Body("foil 50 x 50 x 0.1 mm", block(.05, .05, .0001)),
    Body("bar 200 x 30 x 20 mm", block(.2, .03, .02)),
    Body("rod 1 m x 4 mm", block(1, .004, .004)),
    Body("cube 1 mm", block(.001, .001, .001)),
    Body("cube 1 m", block(1, 1, 1)),
    Body("box 20 m", block(20, 20, 20)),
    Body("beam 20 m", block(20, .3, .3)),
    Body("ball 50 mm", lambda: ball(.05)),
    Body("ball 2 m", lambda: ball(2)),
    Body("ring 3 mm", lambda: torus(.003, .0005)),
    Body("ring 60 mm", lambda: torus(.06, .004)),
    Body("gear 44 mm", gear),
    Body("spring 4 turns", spring),
    Body("bunny 150 mm, solid", lambda: bodies.bunny(.15, .15 / 28), "bunny_ceramic"),
    Body("bunny 150 mm, hollow", lambda: bodies.bunny(.15, .15 / 50, .006), "bunny_ceramic"),
    Body("bunny of glmark2", pathlib.Path(bodies.BUNNY), "bunny_ceramic", ("--repair",)),
    Body("bunny of glmark2, abs", pathlib.Path(bodies.BUNNY), "abs", ("--repair",)),
    Body("spider.obj (game)", MODELS / "OBJ/spider.obj", arguments=("--repair",)),
    Body("WusonOBJ.obj (game)", MODELS / "OBJ/WusonOBJ.obj", arguments=("--repair",)),
    Body("box.obj", MODELS / "OBJ/box.obj", arguments=("--repair",)),
    Body("Spider_ascii.stl (CAD)", MODELS / "STL/Spider_ascii.stl", arguments=("--repair",)),
    Body("Wuson.ply (game)", MODELS / "PLY/Wuson.ply", arguments=("--repair",)),
    Body("cube.ply", MODELS / "PLY/cube.ply", arguments=("--repair",)),
    Body("BoxTextured.glb", MODELS / "glTF2/BoxTextured-glTF-Binary/BoxTextured.glb", arguments=("--repair",)),
    Body("2CylinderEngine.glb (CAD)", MODELS / "glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb",
         arguments=("--repair",)),
]


def errors_by_order(report, finer):
    """True errors of the modes that both reports have. Modes of different errors may swap places, so they are paired
    in the order of what the estimate makes of them."""
    frequency = measured.column(report, "frequency_hz")
    order = numpy.argsort(frequency / (1 + measured.column(report, "estimated_error")))[:len(finer["modes"])]
    return frequency[order] / measured.column(finer, "frequency_hz")[:len(order)] - 1


def true_errors(body, surface, run, options, environment):
    """Stated and true largest error of the modes that both meshes have; None where no finer mesh can be had."""
    nodes = run.report["nodes"]
    if FINER * nodes > (MOST_NODES if options.full else MOST_NODES_QUICK):
        return None
    high = max(mode["frequency_hz"] for mode in run.report["modes"])
    corners = ["--nodes", str(FINER * nodes // NODES_PER_CORNER), "--band", f"20:{max(high, 21):.6g}"]
    finer = measured.precompute(surface, [*body.arguments, "--material", body.material, *corners], options,
                                environment, 4 * MOST_SECONDS)
    if finer.verdict != "model":
        return None
    return 100 * abs(errors_by_order(run.report, finer.report)).max(), finer.report["nodes"] / nodes


def row(body, surface, options, environment):
    run = measured.precompute(surface, [*body.arguments, "--material", body.material], options, environment,
                              MOST_SECONDS)
    cells = [body.name, run.verdict, f"{run.cpu_seconds:.1f}", f"{run.wall_seconds:.1f}", f"{run.peak_gib:.2f}"]
    if run.verdict != "model":
        return [*cells, *[""] * 4]
    modes = run.report["modes"]
    stated = 100 * max(mode["estimated_error"] for mode in modes)
    true = true_errors(body, surface, run, options, environment)
    truth = "not computed" if true is None else f"{true[0]:.2f} % ({true[1]:.1f} times the nodes)"
    return [*cells, run.report["nodes"], len(modes), f"{stated:.2f} %", truth]


def users(options, folder, environment):
    bench.print_head("body", "verdict", "CPU s", "wall s", "peak GiB", "nodes", "modes", "largest stated error",
                     "largest true error")
    for number, body in enumerate(BODIES):
        if options.only and body.name not in options.only:
            continue
        surface = body.source
        if not isinstance(surface, pathlib.Path):
            surface = folder / f"{number}.obj"
            bodies.write_obj(surface, *body.source())
        bench.print_row(*row(body, surface, options, environment))
