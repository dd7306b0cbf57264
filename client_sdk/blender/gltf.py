# SPDX-License-Identifier: Apache-2.0
"""Writes bodies and their motion as a binary glTF with KHR_physics_rigid_bodies, as `carillon foley` reads it: metres,
seconds, and y up. Each node keeps the axes of its object."""

import json
import struct

import numpy

HALF = 0.5 ** 0.5


def y_up(positions, orientations):
    """From z up; orientations are w, x, y, z, and those returned x, y, z, w."""
    w, x, y, z = numpy.asarray(orientations, float).T
    turned = numpy.stack([HALF * (x - w), HALF * (y + z), HALF * (z - y), HALF * (w + x)], 1)
    return numpy.asarray(positions, float)[:, [0, 2, 1]] * (1, 1, -1), turned


class GltfWriter:
    """Collects bodies and a camera, all with poses at `times` in seconds."""

    def __init__(self, times):
        self.blob, self.views, self.accessors = bytearray(), [], []
        self.nodes, self.meshes, self.materials, self.frictions = [], [], [], []
        self.samplers, self.channels, self.cameras = [], [], []
        self.times = self._add(numpy.asarray(times), "SCALAR", "<f4", 5126)

    def _add(self, array, kind, dtype, component):
        data = numpy.ascontiguousarray(array, dtype=dtype)
        self.views.append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": data.nbytes})
        self.blob += data.tobytes()
        accessor = {"bufferView": len(self.views) - 1, "componentType": component, "count": len(data), "type": kind}
        if component == 5126:
            accessor |= {"min": numpy.atleast_1d(data.min(0)).tolist(), "max": numpy.atleast_1d(data.max(0)).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def _node(self, name, positions, orientations):
        """A node; it is animated where its pose changes."""
        positions, turns = y_up(positions, orientations)
        node = {"name": name, "translation": positions[0].tolist(), "rotation": turns[0].tolist()}
        if numpy.ptp(positions, 0).max() > 1e-7 or numpy.ptp(turns, 0).max() > 1e-7:
            for path, kind, values in (("translation", "VEC3", positions), ("rotation", "VEC4", turns)):
                self.channels.append({"sampler": len(self.samplers), "target": {"node": len(self.nodes), "path": path}})
                self.samplers.append({"input": self.times, "output": self._add(values, kind, "<f4", 5126)})
        self.nodes.append(node)
        return node

    def add_body(self, body, positions, orientations):
        node = self._node(body.name, positions, orientations)
        node["mesh"] = len(self.meshes)
        primitive = {"attributes": {"POSITION": self._add(body.vertices, "VEC3", "<f4", 5126)},
                     "indices": self._add(body.triangles.reshape(-1), "SCALAR", "<u4", 5125)}
        if body.material:
            primitive["material"] = len(self.materials)
            self.materials.append({"name": body.material})
        self.meshes.append({"primitives": [primitive]})
        collider = {"physicsMaterial": len(self.frictions)}
        # The reader takes the geometric mean of two frictions, and Blender's simulator their product.
        self.frictions.append({"dynamicFriction": body.friction ** 2})
        if body.collider is not None:
            collider["geometry"] = {"mesh": len(self.meshes)}
            self.meshes.append({"primitives": [
                {"attributes": {"POSITION": self._add(body.collider.reshape(-1, 3), "VEC3", "<f4", 5126)}}]})
        if body.rounding:
            collider["extras"] = {"rounding": body.rounding}
        physics = {"collider": collider}
        if body.driven:
            physics["motion"] = {"isKinematic": True}
        elif body.mass:
            physics["motion"] = {"mass": body.mass, "centerOfMass": [0, 0, 0],
                                 "inertiaDiagonal": body.inertia.tolist(),
                                 "extras": dict(zip(("linearDamping", "angularDamping"), body.damping))}
        node["extensions"] = {"KHR_physics_rigid_bodies": physics}

    def add_camera(self, name, positions, orientations):
        self._node(name, positions, orientations)["camera"] = len(self.cameras)
        self.cameras.append({"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}})

    def write(self, path):
        gltf = {"asset": {"version": "2.0", "generator": "Carillon for Blender"}, "scene": 0,
                "scenes": [{"nodes": list(range(len(self.nodes)))}], "nodes": self.nodes, "meshes": self.meshes,
                "extensionsUsed": ["KHR_physics_rigid_bodies"],
                "extensions": {"KHR_physics_rigid_bodies": {"physicsMaterials": self.frictions}},
                "accessors": self.accessors, "bufferViews": self.views, "buffers": [{"byteLength": len(self.blob)}]}
        if self.materials:
            gltf["materials"] = self.materials
        if self.cameras:
            gltf["cameras"] = self.cameras
        if self.channels:
            gltf["animations"] = [{"samplers": self.samplers, "channels": self.channels}]
        text = json.dumps(gltf).encode()
        text += b" " * (-len(text) % 4)
        self.blob += bytes(-len(self.blob) % 4)
        with open(path, "wb") as file:
            file.write(struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(self.blob), len(text), 0x4E4F534A))
            file.write(text + struct.pack("<II", len(self.blob), 0x004E4942) + self.blob)
