# SPDX-License-Identifier: Apache-2.0
"""Meshes as files: read from the disk, or made of arrays and of the objects of other libraries."""

from __future__ import annotations

import base64
import dataclasses
import json
import os
import pathlib
import re
import urllib.parse
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
    """Reads a mesh file. The two files that TetGen writes become one, a .gltf file gets the data of its buffers, and an
    .inp file those that it includes. Their files must be in its folder or below it.

    Raises OSError where a file cannot be read, and CarillonError (MESH_UNREADABLE) where such a file is elsewhere.
    """
    file = pathlib.Path(path)
    mesh_format = file.suffix.lstrip(".").lower()
    if mesh_format in ("node", "ele") and (elements := _with_suffix(file, ".ele")).exists():
        nodes = _with_suffix(file, ".node").read_bytes()
        return MeshFile(nodes.rstrip(b"\n") + b"\n" + elements.read_bytes(), "node", file.stem)
    data = file.read_bytes()
    if mesh_format == "gltf":
        data = _with_buffers(file, data)
    elif mesh_format == "inp":
        data = _with_includes(file, data)
    return MeshFile(data, mesh_format, file.stem)


def _with_suffix(file: pathlib.Path, suffix: str) -> pathlib.Path:
    """The file of the same name with that suffix, also if its name is in capitals."""
    exact = file.with_suffix(suffix)
    same = [other for other in file.parent.iterdir() if other.name.lower() == exact.name.lower()]
    return exact if exact in same or not same else same[0]


_INPUT = re.compile(rb"""^[ \t]*\*(?:(INCLUDE)|(?:NODE|ELEMENT|NSET|ELSET))[ \t]*(?:,[^,\n]*)*?
                        (,[ \t]*INPUT[ \t]*=[ \t]*"?([^",\r\n]+?)"?[ \t]*(?=[,\r\n]|\Z))[^\n]*\n?""",
                    re.I | re.M | re.X)


def _with_includes(file: pathlib.Path, data: bytes, name: str = "", depth: int = 0) -> bytes:
    """The lines of an .inp file, or of the file `name` that it includes, with those of the files that they include. A
    comment "**@ LINE FILE" says from where the next line is."""
    parts, end = [], 0
    for found in _INPUT.finditer(data):
        other = found[3].decode(errors="replace").replace("\\", "/")
        if depth == 16:
            raise CarillonError("MESH_UNREADABLE", f"{file}: {name} includes {other} without an end")
        rest = b"" if found[1] else found[0].replace(found[2], b"").rstrip() + b"\n"
        content = _with_includes(file, _beside(file, other).read_bytes(), other, depth + 1)
        line = data.count(b"\n", 0, found.end()) + 1
        parts += [data[end:found.start()], rest, f"**@ 1 {other}\n".encode(), content.rstrip(b"\n"),
                  f"\n**@ {line} {name}\n".encode()]
        end = found.end()
    return b"".join([*parts, data[end:]])


def _with_buffers(file: pathlib.Path, data: bytes) -> bytes:
    """A glTF document with the data of its buffers in it. A text that is no such document stays as it is, so that the
    daemon says what is wrong with it."""
    try:
        document = json.loads(data.removeprefix(b"\xef\xbb\xbf"))  # a byte order mark
        buffers = document.get("buffers", [])
    except (ValueError, RecursionError, AttributeError):
        return data
    changed = False
    # An array in glTF 2.0, an object in glTF 1.0.
    for buffer in buffers.values() if isinstance(buffers, dict) else buffers if isinstance(buffers, list) else []:
        uri = buffer.get("uri") if isinstance(buffer, dict) else None
        if isinstance(uri, str) and not uri.lower().startswith("data:"):
            content = base64.b64encode(_beside(file, urllib.parse.unquote(uri)).read_bytes()).decode()
            buffer["uri"] = f"data:application/octet-stream;base64,{content}"
            changed = True
    return json.dumps(document).encode() if changed else data


def _beside(file: pathlib.Path, name: str) -> pathlib.Path:
    """A file with data of another. A file elsewhere is refused, because an untrusted document could have any file of
    the user sent to the daemon."""
    path = pathlib.PurePath(name)
    if path.is_absolute() or ".." in path.parts or "://" in name:
        raise CarillonError("MESH_UNREADABLE", f'{file} keeps data in "{name}", which is not in its folder: put it '
                            "there")
    return file.parent / path


def make_obj(vertices: Any, triangles: Any, label: str = "") -> MeshFile:
    """Makes an OBJ file of N x 3 coordinates and M x 3 indices that count from zero."""
    points = _table(vertices, float, "vertices", "metres")
    corners = _table(triangles, numpy.int64, "triangles", "indices of vertices that count from zero")
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


def _table(values: Any, kind: Any, name: str, meaning: str) -> numpy.ndarray:
    table = numpy.asarray(values, dtype=kind)
    if table.ndim != 2 or table.shape[1] != 3:
        raise ValueError(f"{name} has the shape {table.shape}; it must be N x 3: {meaning}")
    return table
