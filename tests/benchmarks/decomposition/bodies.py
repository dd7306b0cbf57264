# SPDX-License-Identifier: Apache-2.0
"""The bodies that the decomposition benchmark decomposes: their surfaces, as OBJ files."""

import math

import numpy

BUNNY = "/usr/share/glmark2/models/bunny.obj"  # crosses itself, so that no mesher takes it


def write_obj(path, vertices, triangles):
    with open(path, "w", encoding="ascii") as file:
        for x, y, z in vertices:
            file.write(f"v {x:.9g} {y:.9g} {z:.9g}\n")
        for a, b, c in triangles:
            file.write(f"f {a + 1} {b + 1} {c + 1}\n")


def polygon_radius(radius, corners):
    """Of the regular polygon with the area of the circle: one inscribed would be a smaller tube."""
    angle = 2 * math.pi / corners
    return radius * math.sqrt(angle / math.sin(angle))


def tube(length, around, along, outer=.0125, wall=.001):
    """Both walls and the ring at each end of a hollow cylinder, as (vertices, triangles)."""
    angle = 2 * math.pi * numpy.arange(around) / around
    circle = numpy.stack([numpy.cos(angle), numpy.sin(angle), 0 * angle], axis=1)
    layers = [(circle * polygon_radius(radius, around) + (0, 0, length * k / along))
              for radius in (outer, outer - wall) for k in range(along + 1)]

    def vertex(side, k, i):
        return (side * (along + 1) + k) * around + i % around

    triangles = []

    def quad(a, b, c, d):
        triangles.extend([(a, b, c), (a, c, d)])

    for i in range(around):
        for k in range(along):
            quad(vertex(0, k, i), vertex(0, k, i + 1), vertex(0, k + 1, i + 1), vertex(0, k + 1, i))
            quad(vertex(1, k, i), vertex(1, k + 1, i), vertex(1, k + 1, i + 1), vertex(1, k, i + 1))
        quad(vertex(0, 0, i), vertex(1, 0, i), vertex(1, 0, i + 1), vertex(0, 0, i + 1))
        quad(vertex(0, along, i), vertex(0, along, i + 1), vertex(1, along, i + 1),
             vertex(1, along, i))
    return numpy.concatenate(layers), triangles


def lathe(profile, around):
    """The surface of a closed profile of (radius, height), counter-clockwise, turned about the z axis; points
    with radius zero are poles."""
    vertices, rings = [], []
    for radius, height in profile:
        count = around if radius > 0 else 1
        rings.append([len(vertices) + i % count for i in range(around + 1)])
        for i in range(count):
            angle = 2 * math.pi * i / around
            vertices.append((radius * math.cos(angle), radius * math.sin(angle), height))
    triangles = []
    for low, high in zip(rings, rings[1:] + rings[:1]):
        for i in range(around):
            for triangle in ((low[i], low[i + 1], high[i + 1]), (low[i], high[i + 1], high[i])):
                if len(set(triangle)) == 3:
                    triangles.append(triangle)
    return numpy.array(vertices), triangles


def bowl(radius, wall, around, along):
    """Half a hollow sphere, open above."""
    angles = [math.pi / 2 * k / along for k in range(along + 1)]
    outer = [(radius * math.sin(a), -radius * math.cos(a)) for a in angles]
    inner = [((radius - wall) * math.sin(a), -(radius - wall) * math.cos(a)) for a in angles]
    return lathe(outer + inner[::-1], around)


def bell(around=32):
    """A bell of our own drawing: 100 mm high, 120 mm wide at its mouth, its wall 2.5 mm at the waist and 5 mm at the
    lip; mouth upwards."""
    outer = numpy.array([(0, 0), (14, 0), (24, 3), (30, 10), (33, 22), (35, 40), (38, 58), (43, 74), (50, 88),
                         (60, 100)], dtype=float)
    inner = numpy.array([(56, 100), (45.5, 89), (39, 75.5), (34.8, 59), (32.3, 41), (30.3, 23), (27, 12.5),
                         (22, 6.5), (13.5, 4), (0, 4)], dtype=float)

    return lathe([(.001 * r, .001 * z) for r, z in numpy.concatenate([outer, inner])], around)


def union(xs, ys, zs, full):
    """The boundary of the grid cells for whose indices (i, j, k) `full` is true; the planes are in metres."""
    planes, count = (xs, ys, zs), (len(xs) - 1, len(ys) - 1, len(zs) - 1)
    number, vertices, triangles = {}, [], []

    def vertex(index):
        if index not in number:
            number[index] = len(vertices)
            vertices.append([planes[a][index[a]] for a in range(3)])
        return number[index]

    def place(axis, *indices):
        """The indices along an axis and the two after it, in the order of the axes."""
        return tuple(indices[(a - axis) % 3] for a in range(3))

    def inside(cell):
        return all(0 <= cell[a] < count[a] for a in range(3)) and full(*cell)

    for axis in range(3):
        for side in range(count[axis] + 1):
            for i, j in numpy.ndindex(count[(axis + 1) % 3], count[(axis + 2) % 3]):
                before, after = (inside(place(axis, layer, i, j)) for layer in (side - 1, side))
                if before == after:
                    continue
                corners = [vertex(place(axis, side, i + u, j + v)) for u, v in ((0, 0), (1, 0), (1, 1), (0, 1))]
                a, b, c, d = corners if before else corners[::-1]
                triangles.extend([(a, b, c), (a, c, d)])
    return numpy.array(vertices), triangles


def box(size, cells):
    """Faces cut into cells; vertices on edges are shared."""
    return union(*([side * i / count for i in range(count + 1)] for side, count in zip(size, cells)), lambda *_: True)


def read_bunny(size):
    """Vertices and triangles, `size` metres along its longest side."""
    vertices, triangles = [], []
    with open(BUNNY, encoding="ascii") as file:
        for line in file:
            words = line.split()
            if words[:1] == ["v"]:
                vertices.append([float(x) for x in words[1:4]])
            elif words[:1] == ["f"]:
                triangles.append([int(word.split("/")[0]) - 1 for word in words[1:4]])
    vertices = numpy.array(vertices)
    vertices *= size / (vertices.max(axis=0) - vertices.min(axis=0)).max()
    return vertices.astype(numpy.float32), numpy.array(triangles, dtype=numpy.uint32)


def isosurface(distance, value, inward):
    vertices, quads = distance.convertToQuads(value)
    triangles = numpy.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(numpy.int64)
    return vertices, triangles if inward else triangles[:, ::-1]


def bunny(size, spacing, wall=0.0):
    """The bunny anew, as an isosurface of its signed distance with vertices `spacing` metres apart; hollow
    where it has a wall."""
    import pyopenvdb  # the other bodies need it not
    vertices, triangles = read_bunny(size)
    distance = pyopenvdb.FloatGrid.createLevelSetFromPolygons(
        vertices, triangles=triangles, transform=pyopenvdb.createLinearTransform(spacing),
        halfWidth=wall / spacing + 3)
    outer, faces = isosurface(distance, 0.0, False)
    if wall == 0:
        return outer, faces
    inner, inner_faces = isosurface(distance, -wall, True)
    return (numpy.concatenate([outer, inner]),
            numpy.concatenate([faces, inner_faces + len(outer)]))
