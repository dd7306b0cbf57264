# SPDX-License-Identifier: Apache-2.0
"""The example of the bunnies: two hollow ones, of ceramic and of metal, slide down a chute and tumble over three
shelves of plastic, aluminium and wood, which are screwed to a wall and sound, too.
"""

import math
import pathlib

import numpy

import falls

BUNNY = pathlib.Path("/usr/share/glmark2/models/bunny.obj")  # of Debian's glmark2-data; it crosses itself
LENGTH_M, WALL_M, KG_PER_M3 = 0.15, 0.008, 2700
SHELF_M = (0.30, 0.30, 0.02)
MOST_CORNERS = 120


def read_obj(path):
    vertices, faces = [], []
    for line in path.read_text(encoding="ascii", errors="replace").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            corners = [int(word.split("/")[0]) - 1 for word in words[1:]]
            faces += [(corners[0], b, c) for b, c in zip(corners[1:], corners[2:])]
    return numpy.array(vertices), numpy.array(faces)


def as_shell(vertices, faces):
    """Area, centre of mass and tensor of inertia for a mass of 1, of a thin shell: each triangle counts as three masses
    in the middles of its sides, which have its moments."""
    corners = vertices[faces]
    areas = numpy.linalg.norm(numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    middles = ((corners + numpy.roll(corners, 1, axis=1)) / 2).reshape(-1, 3)
    weights = numpy.repeat(areas, 3) / (3 * areas.sum())
    centre = weights @ middles
    arms = middles - centre
    second = (weights[:, None] * arms).T @ arms
    return areas.sum(), centre, numpy.trace(second) * numpy.eye(3) - second


def extreme_corners(vertices):
    """The corners of its convex hull that are farthest in evenly spread directions: engines take some hundred."""
    number = numpy.arange(4 * MOST_CORNERS)
    heights = 1 - (2 * number + 1) / len(number)
    turns = numpy.pi * (1 + math.sqrt(5)) * number
    across = numpy.sqrt(1 - heights**2)
    directions = numpy.stack([across * numpy.cos(turns), across * numpy.sin(turns), heights], axis=1)
    farthest = sorted(set(numpy.argmax(vertices @ directions.T, axis=0).tolist()))
    step = -(-len(farthest) // MOST_CORNERS)
    return [vertices[i].tolist() for i in farthest[::step]]


def bunny(folder):
    """The body without name and material. Its frame is that of its centre of mass and its axes of inertia."""
    import scene_makers
    vertices, faces = read_obj(BUNNY)
    vertices *= LENGTH_M / numpy.ptp(vertices, axis=0).max()
    area, centre, inertia = as_shell(vertices, faces)
    moments, axes = numpy.linalg.eigh(inertia)
    axes[:, 2] *= numpy.linalg.det(axes)
    vertices = (vertices - centre) @ axes
    scene_makers.write_obj(folder / "bunny.obj", vertices, faces)
    mass = KG_PER_M3 * WALL_M * area
    return {"mesh": "bunny.obj", "repair": True, "wall_m": WALL_M, "mass_kg": mass, "max_frequency_hz": 12000,
            "inertia_kg_m2": (mass * moments).tolist(), "shape": {"hull": {"corners_m": extreme_corners(vertices)}}}


def board(name, sides, position, slope_degrees, **sounding):
    """A fixed board that goes down towards +x by its slope, or towards -x by a negative one."""
    return {"name": name, "shape": {"boxes": [{"sides_m": list(sides)}]}, "position_m": list(position),
            "orientation": falls.about((0, 1, 0), slope_degrees), **sounding}


def shelf(name, material, position, slope_degrees):
    """Its edge at the wall, in +y, is screwed on: the last 2 cm are fixed."""
    x, y, z = (side / 2 for side in SHELF_M)
    return board(name, SHELF_M, position, slope_degrees, material=material, max_frequency_hz=8000,
                 fixed_m={"low": [-x, y - 0.02, -z], "high": [x, y, z]})


def chute():
    """A floor of 50 degrees and two sides; it is silent."""
    length, width, side, wall = 0.5, 0.24, 0.12, 0.02
    at = (-0.42, 0, 1.28)
    down = falls.about((0, 1, 0), 50)
    boards = [board("chute", (length, width, wall), at, 50)]
    for name, sign in (("near side", -1), ("far side", 1)):
        offset = falls.rotated(down, (0, sign * (width + wall) / 2, side / 2))
        boards.append(board(name, (length, wall, side), [a + b for a, b in zip(at, offset)], 50))
    return boards


def bunnies(folder):
    """The scene. Shelves slope to either side by turns, so that a bunny tumbles down all three."""
    shape = bunny(folder)
    bodies = [{"name": "floor", "shape": {"plane": {}}}, *chute(),
              board("wall", (1.2, 0.02, 1.6), (-0.1, SHELF_M[1] / 2 + 0.01, 0.8), 0),
              shelf("plastic shelf", "shelf_plastic", (0.0, 0, 0.90), -24),
              shelf("aluminium shelf", "shelf_aluminum", (-0.30, 0, 0.56), 24),
              shelf("wooden shelf", "shelf_wood", (0.04, 0, 0.24), -24)]
    # The metal bunny comes after the ceramic one.
    for name, material, up in (("ceramic bunny", "bunny_ceramic", 0.0), ("metal bunny", "bunny_metal", 0.5)):
        bodies.append({"name": name, "material": material, **shape, "position_m": [-0.52, 0, 1.6 + up],
                       "orientation": falls.product(falls.about((0, 0, 1), 30 + 60 * up),
                                                    falls.about((1, 0, 0), 40)),
                       "angular_velocity_rad_per_s": [0, 2 + up, 0]})
    return {"friction": 0.25, "restitution": 0.1, "seconds": 4, "extent_m": 1.2, "bodies": bodies,
            "camera_m": (0.7, -2.9, 1.5), "look_at_m": (-0.15, 0, 0.85)}
