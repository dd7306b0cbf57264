# SPDX-License-Identifier: Apache-2.0
"""Small bodies as OBJ files, good and bad ones."""

import itertools
import math

MATERIAL = "chime_aluminum"
YOUNG_PA, DENSITY, ALPHA1_S = 6.835179e10, 2700, 1e-7  # of that preset

BOX_FACES = ((0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7), (0, 1, 5), (0, 5, 4),
             (1, 2, 6), (1, 6, 5), (2, 3, 7), (2, 7, 6), (3, 0, 4), (3, 4, 7))


def obj(vertices, faces):
    """Vertices as numbers, faces counted from 0."""
    lines = [f"v {x} {y} {z}" for x, y, z in vertices]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in faces]
    return ("\n".join(lines) + "\n").encode()


def box(size, low=(0, 0, 0)):
    """(vertices, faces) of a box; counter-clockwise from outside."""
    corners = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    return [tuple(l + s * c for l, s, c in zip(low, size, corner)) for corner in corners], BOX_FACES


def centred_box(size):
    return box(size, [-side / 2 for side in size])


def joined(*parts):
    vertices, faces = [], []
    for part_vertices, part_faces in parts:
        faces += [tuple(i + len(vertices) for i in face) for face in part_faces]
        vertices += part_vertices
    return vertices, faces


# A slender free bar, its bending modes in two planes far apart.
BAR_SIZE = (0.200, 0.016, 0.010)


def bar():
    return obj(*box(BAR_SIZE))


def tetrahedra_of_bar(*cells):
    """(nodes, tetrahedra counted from 0) of the bar, cut into so many cells a side, each into the six
    tetrahedra that climb from its lowest corner to its highest along the axes, in all orders."""
    at = {}
    for corner in itertools.product(*(range(count + 1) for count in cells)):
        at[corner] = len(at)
    nodes = [tuple(side * i / count for side, i, count in zip(BAR_SIZE, corner, cells)) for corner in at]
    tetrahedra = []
    for low in itertools.product(*map(range, cells)):
        for order in itertools.permutations(range(3)):
            path = [low]
            for axis in order:
                path.append(tuple(i + (k == axis) for k, i in enumerate(path[-1])))
            tetrahedra.append(tuple(at[corner] for corner in path))
    return nodes, tetrahedra


def bar_first_bending_hz():
    """Euler-Bernoulli, free-free, in the thin direction: 4.730041^2/(2 pi L^2) sqrt(E h^2/(12 rho))."""
    length, _, height = BAR_SIZE
    return (4.730041**2 / (2 * math.pi * length**2)
            * math.sqrt(YOUNG_PA * height**2 / (12 * DENSITY)))
