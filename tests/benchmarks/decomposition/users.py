# SPDX-License-Identifier: Apache-2.0
"""Bodies as users have them, with the defaults, and meshes of growing size: verdict, cost and stated errors."""

import dataclasses
import math
import pathlib
from typing import Callable

import bench
import bodies
import measured
import numpy

MODELS = pathlib.Path("/usr/share/assimp/models")
MOST_SECONDS = 900
LINEAR = ("--element", "linear", "--mass", "lumped", "--keep-surface")


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


def fine_tube(around, along, *nodes):
    return Body(f"tube of {around} x {along} cells", lambda: bodies.tube(.505, around, along), "chime_aluminum",
                (*LINEAR, *nodes))


def solid(cells, nodes):
    return Body(f"solid of {nodes} nodes", lambda: bodies.box((.1, .1, .1), (cells,) * 3), "bunny_ceramic",
                (*LINEAR, "--nodes", str(nodes)))


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
    Body("spider.obj (game)", MODELS / "OBJ/spider.obj", arguments=("--repair",)),
    Body("Spider_ascii.stl (CAD)", MODELS / "STL/Spider_ascii.stl", arguments=("--repair",)),
    Body("Wuson.ply (game)", MODELS / "PLY/Wuson.ply", arguments=("--repair",)),
    Body("BoxTextured.glb", MODELS / "glTF2/BoxTextured-glTF-Binary/BoxTextured.glb", arguments=("--repair",)),
    Body("2CylinderEngine.glb (CAD)", MODELS / "glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb",
         arguments=("--repair",)),
]
GROWING = [fine_tube(48, 195), fine_tube(90, 333), fine_tube(144, 520), fine_tube(200, 749),
           fine_tube(255, 955, "--nodes", "1000000"), solid(20, 9000), solid(27, 20000), solid(43, 80000),
           solid(67, 262000)]


def row(body, surface, options, environment):
    run = measured.precompute(surface, [*body.arguments, "--material", body.material], options, environment,
                              MOST_SECONDS)
    cells = [body.name, run.verdict, f"{run.cpu_seconds:.1f}", f"{run.wall_seconds:.1f}", f"{run.peak_gib:.2f}"]
    if run.verdict != "model":
        return [*cells, *[""] * 3]
    modes = run.report["modes"]
    stated = 100 * max(mode["estimated_error"] for mode in modes)
    return [*cells, run.report["nodes"], len(modes), f"{stated:.2f} %"]


def users(options, folder, environment):
    bench.print_head("body", "verdict", "CPU s", "wall s", "peak GiB", "nodes", "modes", "largest stated error")
    for number, body in enumerate([*BODIES, *(GROWING if options.full else [])]):
        if options.only and body.name not in options.only:
            continue
        surface = body.source
        if not isinstance(surface, pathlib.Path):
            surface = folder / f"{number}.obj"
            bodies.write_obj(surface, *body.source())
        bench.print_row(*row(body, surface, options, environment))
