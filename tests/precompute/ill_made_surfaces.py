# SPDX-License-Identifier: AGPL-3.0-or-later
"""Closed bodies, and what artists, exporters and scanners make of them."""

import math
import random
from dataclasses import dataclass, field

# A bar and a ball, the ball's mesh about as fine as the bar's.
BAR_M = (0.20, 0.03, 0.02)
BAR_CELLS = (20, 3, 2)
BALL_RADIUS_M = 0.1


@dataclass
class IllMade:
    """`plain` and `repaired`: the reason expected, or the body it must be then ("bar", "ball", or "model"
    where any will do)."""
    name: str
    content: bytes
    plain: str
    repaired: str
    options: list = field(default_factory=list)


def grid(cells):
    """The surface of a unit box cut into cells: (vertices, triangles)."""
    numbers, vertices, triangles = {}, [], []

    def vertex(point):
        if point not in numbers:
            numbers[point] = len(vertices)
            vertices.append(tuple(c / n for c, n in zip(point, cells)))
        return numbers[point]

    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, cells[axis]):
            for i in range(cells[u]):
                for j in range(cells[v]):
                    def corner(a, b):
                        point = [0, 0, 0]
                        point[axis], point[u], point[v] = side, i + a, j + b
                        return vertex(tuple(point))
                    square = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]
                    if side == 0:
                        square.reverse()
                    triangles += [square[:3], [square[0], square[2], square[3]]]
    return vertices, triangles


def box(size, low=(0, 0, 0), cells=(1, 1, 1)):
    vertices, triangles = grid(cells)
    return [tuple(l + s * c for l, s, c in zip(low, size, p)) for p in vertices], triangles


def bar():
    return box(BAR_M, cells=BAR_CELLS)


def ball(cells=10):
    vertices, triangles = box((2, 2, 2), (-1, -1, -1), (cells,) * 3)
    return [tuple(BALL_RADIUS_M * c / math.hypot(*p) for c in p) for p in vertices], triangles


def joined(*parts):
    vertices, triangles = [], []
    for more_vertices, more_triangles in parts:
        triangles += [[i + len(vertices) for i in t] for t in more_triangles]
        vertices += more_vertices
    return vertices, triangles


def reversed_(part):
    return part[0], [t[::-1] for t in part[1]]


def obj(part, digits=17):
    vertices, triangles = part
    lines = ["v " + " ".join(f"{c:.{digits}g}" for c in p) for p in vertices]
    lines += ["f " + " ".join(str(i + 1) for i in t) for t in triangles]
    return ("\n".join(lines) + "\n").encode()


def soup(part, jitter, seed=1):
    """Each triangle with vertices of its own, moved at random by up to `jitter` metres."""
    chance = random.Random(seed)
    vertices, triangles = [], []
    for triangle in part[1]:
        triangles.append([len(vertices) + i for i in range(3)])
        vertices += [tuple(c + jitter * chance.uniform(-1, 1) for c in part[0][i]) for i in triangle]
    return vertices, triangles


def turned(part, share, seed=2):
    chance = random.Random(seed)
    return part[0], [t[::-1] if chance.random() < share else t for t in part[1]]


def without(part, count, seed=3):
    kept = list(part[1])
    random.Random(seed).shuffle(kept)
    return part[0], kept[count:]


def with_t_junctions(part, count):
    """The middles of some edges added to the triangle on one side only."""
    vertices, triangles = list(part[0]), list(part[1])
    for t in range(0, 7 * count, 7):
        a, b, c = triangles[t]
        middle = tuple((x + y) / 2 for x, y in zip(vertices[a], vertices[b]))
        triangles[t] = [a, len(vertices), c]
        triangles.append([len(vertices), b, c])
        vertices.append(middle)
    return vertices, triangles


def where(part, kept):
    """The triangles whose corners are kept."""
    return part[0], [t for t in part[1] if kept([part[0][i] for i in t])]


def without_lid(part):
    top = max(p[2] for p in part[0])
    return where(part, lambda corners: any(p[2] < top for p in corners))


def plate():
    """An open sheet."""
    return where(box((0.2, 0.1, 1), cells=(12, 6, 1)), lambda corners: all(p[2] == 0 for p in corners))


def half_ball():
    return where(ball(), lambda corners: all(p[2] <= 1e-12 for p in corners))


def open_tube():
    return where(bar(), lambda corners: not any(all(p[0] == x for p in corners) for x in (0, BAR_M[0])))


def moved(part, offset):
    return [tuple(c + o for c, o in zip(p, offset)) for p in part[0]], part[1]


def scaled(part, factor):
    return [tuple(factor * c for c in p) for p in part[0]], part[1]


def cases():
    """At least forty; the sizes of a defect are relative to a bar of 0.2 m."""
    found = []

    def add(name, part, plain, repaired, **more):
        content = part if isinstance(part, bytes) else obj(part)
        found.append(IllMade(name, content, plain, repaired, **more))

    for jitter in (0, 1e-9, 3e-8):
        add(f"own vertices, {jitter:g} m apart", soup(bar(), jitter),
            "bar" if jitter == 0 else "MESH_NOT_CLOSED", "bar")
    for jitter in (3e-6, 3e-5, 3e-4):
        add(f"gaps of {jitter:g} m", soup(bar(), jitter), "MESH_NOT_CLOSED", "bar")
    for share in (0.01, 0.3):
        add(f"{share:.0%} of the triangles turned", turned(bar(), share), "MESH_NOT_ORIENTED", "bar")
    add("inside out", reversed_(bar()), "bar", "bar")
    add("ball, half of it turned", turned(ball(), 0.5), "MESH_NOT_ORIENTED", "ball")
    for count in (1, 5, 20):
        add(f"{count} T-junctions", with_t_junctions(bar(), count), "MESH_NOT_CLOSED", "bar")
    add("the shell twice", joined(bar(), bar()), "MESH_DUPLICATE_SHELL", "bar")
    add("the shell twice, 1e-9 m apart", joined(bar(), moved(bar(), (1e-9, 0, 0))),
        "MESH_", "bar")
    add("a box inside, turned like it", joined(bar(), box((0.1, 0.01, 0.005), (0.05, 0.01, 0.005))),
        "MESH_NOT_ORIENTED", "model")
    add("two bars apart", joined(bar(), moved(bar(), (0, 0.1, 0))), "MESH_SEVERAL_PIECES",
        "MESH_SEVERAL_PIECES")
    add("two bars crossed", joined(bar(), box((0.03, 0.20, 0.02), (0.085, -0.085, 0.001),
                                              (3, 20, 2))), "MESH_SELF_INTERSECTING", "model")
    add("two halves that overlap", joined(box((0.11, 0.03, 0.02), cells=(11, 3, 2)),
                                          box((0.11, 0.03, 0.02), (0.09, 0, 0), (11, 3, 2))),
        "MESH_", "bar")
    add("two halves that touch", joined(box((0.1, 0.03, 0.02), cells=(10, 3, 2)),
                                        box((0.1, 0.03, 0.02), (0.1, 0, 0), (10, 3, 2))),
        "MESH_", "bar")
    add("a spike through the other side",
        (lambda p: (p[0][:-1] + [(0.1, 0.015, -0.05)], p[1]))(bar()), "MESH_SELF_INTERSECTING",
        "model")
    add("a wall inside", joined(bar(), where(box((0.1, 0.03, 0.02), cells=(10, 3, 2)), lambda corners: all(
        abs(p[0] - 0.1) < 1e-12 for p in corners))), "MESH_", "bar")
    add("two boxes at an edge", joined(box((0.1, 0.1, 0.1)), box((0.1, 0.1, 0.1), (0.1, 0.1, 0))),
        "MESH_", "model")
    add("two boxes at a corner", joined(box((0.1, 0.1, 0.1)), box((0.1, 0.1, 0.1), (0.1, 0.1, 0.1))),
        "MESH_", "model")
    for count in (1, 3):
        add(f"{count} triangles missing", without(bar(), count), "MESH_NOT_CLOSED", "bar")
    add("a triangle of a fine ball missing", without(ball(80), 1), "MESH_NOT_CLOSED", "ball")
    add("no lid", without_lid(bar()), "MESH_NOT_CLOSED", "MESH_NOT_CLOSED")
    add("no lid, with a wall", without_lid(bar()), "model", "model", options=["--wall", "2mm"])
    add("an open plate", plate(), "MESH_NOT_CLOSED", "MESH_NOT_CLOSED")
    add("an open plate, with a wall", plate(), "model", "model", options=["--wall", "3mm"])
    add("half a ball, open", half_ball(), "MESH_NOT_CLOSED", "MESH_NOT_CLOSED")
    add("half a ball, open, with a wall", half_ball(), "model", "model", options=["--wall", "4mm"])
    add("an open tube", open_tube(), "MESH_NOT_CLOSED", "MESH_NOT_CLOSED")
    add("a ball with a wall", ball(), "model", "model", options=["--wall", "0.01"])
    add("a bar with a wall thicker than it", bar(), "MESH_WALL_IMPOSSIBLE", "MESH_WALL_IMPOSSIBLE",
        options=["--wall", "20mm"])
    add("triangle soup, turned at random", turned(soup(bar(), 1e-5), 0.5), "MESH_NOT_CLOSED", "bar")
    add("triangles with no extent", joined(bar(), ([(0, 0, 0), (0.01, 0, 0), (0.02, 0, 0)],
                                                   [[0, 1, 2]])), "MESH_", "bar")
    add("needles", box(BAR_M, cells=(1, 60, 1)), "model", "model")
    add("flat", box((0.2, 0.03, 0), cells=BAR_CELLS), "MESH_", "MESH_")
    add("a point only", box((0, 0, 0)), "MESH_", "MESH_")
    add("far from the origin", moved(bar(), (1000, 0, 0)), "bar", "bar")
    add("a cavity turned like its body", joined(ball(), scaled(ball(), 0.5)), "MESH_NOT_ORIENTED",
        "model")
    add("not a number", obj(bar()).replace(b"v 0 0 0\n", b"v nan 0 0\n", 1), "MESH_NOT_FINITE",
        "MESH_NOT_FINITE")
    add("an index too large", obj(bar()) + b"f 1 2 99999\n", "MESH_INDEX_OUT_OF_RANGE",
        "MESH_INDEX_OUT_OF_RANGE")
    add("empty", b"", "MESH_EMPTY", "MESH_EMPTY")
    add("text", b"Lorem ipsum dolor sit amet\n" * 100, "MESH_", "MESH_")
    add("zeros", bytes(4096), "MESH_", "MESH_")
    return found
