# SPDX-License-Identifier: Apache-2.0
"""Meshes as files: read from the disk, or made of arrays and of the objects of other libraries."""

from __future__ import annotations

import dataclasses
import os
import pathlib
from typing import Any

import numpy

from carillon.errors import CarillonError


@dataclasses.dataclass(frozen=True)
class MeshFile:
    """The bytes of a mesh file, its format as CreateModalModelRequest.mesh_format names it, and a label."""

    data: bytes
    format: str
    label: str = ""


def read_mesh(path: str | os.PathLike[str]) -> MeshFile:
    """Reads a mesh file; the two files that TetGen writes become one."""
    file = pathlib.Path(path)
    mesh_format = file.suffix.lstrip(".").lower()
    if mesh_format in ("node", "ele") and file.with_suffix(".ele").exists():
        nodes = file.with_suffix(".node").read_bytes()
        return MeshFile(nodes.rstrip(b"\n") + b"\n" + file.with_suffix(".ele").read_bytes(), "node", file.stem)
    return MeshFile(file.read_bytes(), mesh_format, file.stem)


def make_obj(vertices: Any, triangles: Any, label: str = "") -> MeshFile:
    """Makes an OBJ file of N x 3 coordinates and M x 3 indices that count from zero."""
    points = _table(vertices, float, "vertices")
    corners = _table(triangles, numpy.int64, "triangles")
    if len(corners) and (corners.min() < 0 or corners.max() >= len(points)):
        raise CarillonError("MESH_INDEX_OUT_OF_RANGE", f"a triangle names a vertex outside 0 to {len(points) - 1}; "
                            "indices count from zero")
    lines = [f"v {_number(x)} {_number(y)} {_number(z)}\n" for x, y, z in points.tolist()]
    lines += [f"f {i} {j} {k}\n" for i, j, k in (corners + 1).tolist()]
    return MeshFile("".join(lines).encode(), "obj", label)


def _number(value: float) -> str:
    """The fewest digits that give the number back, written as each client writes them, so that equal arrays make
    equal files."""
    digits, exponential, exponent = repr(value + 0.0).partition("e")
    return f"{digits}e{int(exponent):+d}" if exponential else digits.removesuffix(".0")


def to_mesh_file(mesh: Any) -> MeshFile:
    """Accepts a MeshFile, a path, a pair (vertices, triangles), and every object with the arrays `vertices` and either
    `faces` (as trimesh has it) or `triangles` (as Open3D has it)."""
    if isinstance(mesh, MeshFile):
        return mesh
    if isinstance(mesh, (str, os.PathLike)):
        return read_mesh(mesh)
    if isinstance(mesh, tuple) and len(mesh) == 2:
        return make_obj(*mesh)
    for name in ("faces", "triangles"):
        if hasattr(mesh, "vertices") and hasattr(mesh, name):
            return make_obj(mesh.vertices, getattr(mesh, name))
    raise TypeError(f"{type(mesh).__name__} is no mesh: give a path, (vertices, triangles), or an object with vertices "
                    "and faces or triangles")


def _table(values: Any, kind: Any, name: str) -> numpy.ndarray:
    table = numpy.asarray(values, dtype=kind)
    if table.ndim != 2 or table.shape[1] != 3:
        raise CarillonError("MESH_SHAPE_WRONG", f"{name} has the shape {table.shape}; it must be N x 3")
    return table
