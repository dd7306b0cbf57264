# SPDX-License-Identifier: Apache-2.0
"""Small bodies as OBJ files, good and bad ones."""

import itertools
import json
import math
import struct

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


def gltf_with_buffer(size, folder, name="box"):
    """Writes a box as NAME.gltf, whose data is in the file NAME.bin beside it, into the folder. The .gltf file."""
    vertices, faces = box(size)
    corners = [index for face in faces for index in face]
    data = struct.pack(f"<{3 * len(vertices)}f", *(x for vertex in vertices for x in vertex))
    points = len(data)
    data += struct.pack(f"<{len(corners)}H", *corners)
    (folder / f"{name}.bin").write_bytes(data)
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(data), "uri": f"{name}.bin"}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": points},
                        {"buffer": 0, "byteOffset": points, "byteLength": len(data) - points}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3",
                       "min": [0, 0, 0], "max": list(size)},
                      {"bufferView": 1, "componentType": 5123, "count": len(corners), "type": "SCALAR"}]}
    file = folder / f"{name}.gltf"
    file.write_text(json.dumps(document))
    return file


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


TUBE_RADIUS = 0.0125


def tube(length=0.3, wall=0.001, around=24, along=28):
    """A chime, centred, about z; its polygon has the circle's area."""
    angle = 2 * math.pi / around
    correction = math.sqrt(angle / math.sin(angle))
    vertices = [
        (r * correction * math.cos(i * angle), r * correction * math.sin(i * angle),
         length * (ring / along - 0.5))
        for r in (TUBE_RADIUS, TUBE_RADIUS - wall) for ring in range(along + 1) for i in range(around)]
    inner = (along + 1) * around
    faces = []

    def band(low, high):
        for i in range(around):
            j = (i + 1) % around
            faces.extend(((low + i, low + j, high + j), (low + i, high + j, high + i)))

    for ring in range(along):
        band(ring * around, (ring + 1) * around)
        band(inner + (ring + 1) * around, inner + ring * around)
    band(inner, 0)
    band(along * around, inner + along * around)
    return obj(vertices, faces)


def bowl(radius=0.08, wall=0.004, around=48, down=12):
    """Half a sphere that opens along +z, about its centre of mass if it were thin."""
    middle = (0.0, 0.0, radius / 2)
    vertices, faces = [], []
    for r in (radius, radius - wall):
        for ring in range(down):
            angle = math.pi / 2 * (1 - ring / down)  # of the rim, then down to the bottom
            vertices += [(middle[0] + r * math.sin(angle) * math.cos(2 * math.pi * i / around),
                          middle[1] + r * math.sin(angle) * math.sin(2 * math.pi * i / around),
                          middle[2] - r * math.cos(angle)) for i in range(around)]
        vertices.append((0.0, 0.0, middle[2] - r))
    inner = down * around + 1

    def band(upper, lower):
        for i in range(around):
            j = (i + 1) % around
            faces.extend(((upper + i, lower + i, lower + j), (upper + i, lower + j, upper + j)))

    for ring in range(down - 1):
        band(ring * around, (ring + 1) * around)
        band(inner + (ring + 1) * around, inner + ring * around)
    for i in range(around):
        j = (i + 1) % around
        last = (down - 1) * around
        faces.append((last + i, last + around, last + j))
        faces.append((inner + last + j, inner + last + around, inner + last + i))
    band(inner, 0)  # the rim
    return obj(vertices, faces)
