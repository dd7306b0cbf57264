# SPDX-License-Identifier: Apache-2.0
"""Scenes of bodies that fall (docs/decisions/0042): their models from the daemon, and their contacts from an engine."""

import copy
import itertools
import json
import math
import os
import pathlib
import subprocess

from carillon.v1 import contact_pb2, modal_model_pb2

HERE = pathlib.Path(__file__).resolve().parent
SCENES = HERE / "scenes"
IN_NODE = ("rapier", "havok")
ENGINES = ("bullet", "ode", "mujoco", *IN_NODE)

BOX_FACES = ((0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7), (0, 1, 5), (0, 5, 4),
             (1, 2, 6), (1, 6, 5), (2, 3, 7), (2, 7, 6), (3, 0, 4), (3, 4, 7))
ICOSAHEDRON_FACES = ((0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2),
                     (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5),
                     (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1))


def box_mesh(sides):
    corners = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    return [tuple(side * (c - 0.5) for side, c in zip(sides, corner)) for corner in corners], list(BOX_FACES)


def ball_mesh(radius, halvings=3):
    """An icosahedron whose triangles are halved and moved out to the sphere."""
    golden = (1 + math.sqrt(5)) / 2
    vertices = [(a, b * golden, 0) for b in (1, -1) for a in (-1, 1)]
    vertices += [(0, a, b * golden) for b in (1, -1) for a in (-1, 1)]
    vertices += [(a * golden, 0, b) for a in (1, -1) for b in (-1, 1)]
    faces = list(ICOSAHEDRON_FACES)
    for _ in range(halvings):
        vertices, faces = halved(vertices, faces)
    return [tuple(radius * x / math.hypot(*vertex) for x in vertex) for vertex in vertices], faces


def halved(vertices, faces):
    vertices, middles = list(vertices), {}

    def middle(a, b):
        key = (min(a, b), max(a, b))
        if key not in middles:
            point = [(x + y) / 2 for x, y in zip(vertices[a], vertices[b])]
            scale = math.hypot(*vertices[a]) / math.hypot(*point)
            vertices.append(tuple(scale * x for x in point))
            middles[key] = len(vertices) - 1
        return middles[key]

    made = []
    for a, b, c in faces:
        ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
        made += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    return vertices, made


def mesh_of(body, folder):
    """The surface that sounds: a file beside the scene, or the shape itself."""
    if "mesh" in body:
        return str(folder / body["mesh"])
    shape = body["shape"]
    return ball_mesh(shape["ball"]["radius_m"]) if "ball" in shape else box_mesh(shape["boxes"][0]["sides_m"])


# All that makes one model another.
SOUNDING = ("shape", "mesh", "repair", "wall_m", "fixed_m", "material", "max_frequency_hz")


def settings_of(body):
    """How the body is decomposed."""
    settings = modal_model_pb2.DecompositionSettings()
    settings.mesh.wall_m = body.get("wall_m", 0)
    settings.mesh.repair = body.get("repair", False)
    if "fixed_m" in body:
        low, high = (contact_pb2.Vec3(x=x, y=y, z=z) for x, y, z in (body["fixed_m"]["low"], body["fixed_m"]["high"]))
        settings.fixtures.add().box.CopyFrom(modal_model_pb2.FixedBox(low_m=low, high_m=high))
    return settings


def create_models(client, scene, folder=SCENES):
    """Returns the scene with the name of a model in each body that has a material; `folder` has the meshes. Bodies of
    one shape share a model."""
    made, models = copy.deepcopy(scene), {}
    for body in made["bodies"]:
        if "material" not in body:
            continue
        key = json.dumps([body.get(name) for name in SOUNDING])
        if key not in models:
            models[key] = client.create_model(mesh_of(body, folder), body["material"], settings=settings_of(body),
                                              label=body["name"], max_frequency_hz=body.get("max_frequency_hz", 0))
        body["model"] = models[key].name
    return made


def record(engine, scene, trace, *, rate=240, seconds=None, build=None):
    """Lets a scene with models fall in an engine and leaves its contact trace. Without `seconds` it lasts as long as
    the scene says."""
    path = pathlib.Path(trace).with_suffix(".json")
    path.write_text(json.dumps(scene, indent=1))
    build = pathlib.Path(build or HERE.parents[2] / "build/release")
    program = ["node", HERE / "fall.js"] if engine in IN_NODE else [build / "bin/carillon-fall"]
    words = [*program, path, trace, "--engine", engine, "--rate", str(rate)]
    subprocess.run([*words, *([] if seconds is None else ["--seconds", str(seconds)])], check=True,
                   env=node_environment(path.parent) if engine in IN_NODE else None)


def node_environment(folder):
    """The environment in which require() finds the package `carillon` of the checkout, and the engines."""
    modules = folder / "node_modules"
    if not modules.exists():
        modules.mkdir()
        (modules / "carillon").symlink_to(HERE.parents[1] / "node")
    places = (modules, os.environ["CARILLON_NODE_MODULES"], os.environ["CARILLON_ENGINE_MODULES"])
    return {**os.environ, "NODE_PATH": ":".join(map(str, places))}


def product(*turns):
    """The quaternion w, x, y, z of turns one after another, the last first."""
    result = (1.0, 0.0, 0.0, 0.0)
    for w, x, y, z in turns:
        a, b, c, d = result
        result = (a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y, a * y - b * z + c * w + d * x,
                  a * z + b * y - c * x + d * w)
    return result


def about(axis, degrees):
    """The quaternion of a turn about an axis."""
    half, length = math.radians(degrees) / 2, math.hypot(*axis)
    return (math.cos(half), *(math.sin(half) * x / length for x in axis))


def rotated(turn, vector):
    w, x, y, z = turn
    return product(turn, (0, *vector), (w, -x, -y, -z))[1:]


def box_inertia(mass, sides):
    x, y, z = sides
    return [mass * (y * y + z * z) / 12, mass * (x * x + z * z) / 12, mass * (x * x + y * y) / 12]


def corners(sides):
    return [tuple(s * side / 2 for s, side in zip(signs, sides)) for signs in itertools.product((-1, 1), repeat=3)]
