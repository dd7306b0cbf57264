# SPDX-License-Identifier: Apache-2.0
"""Contacts found from motion alone: poses, surfaces and materials in, a trace out.

    found = carillon.motion.contacts({"cup": carillon.motion.Body((vertices, triangles), "porcelain")}, times,
                                     {"cup": (positions, orientations)}, floor=0)
    sound = client.render(found.trace)

The program `carillon foley` does the work (docs/motion.md), so it must be installed.
"""

from __future__ import annotations

import dataclasses
import pathlib
import re
import tempfile
from collections.abc import Mapping, Sequence
from typing import Any, Optional

from carillon import programs
from carillon.errors import CarillonError
from carillon.traces import Trace


@dataclasses.dataclass
class Body:
    """A body that moves. `surface` is its closed surface in its own frame: vertices in metres (N, 3) and triangles of
    indices (M, 3). Without a `material` it is silent. `wall` in metres makes it hollow. `mass` in kilograms is that of
    the simulation, if it differs from that of the material."""

    surface: tuple[Any, Any]
    material: str = "none"
    wall: Optional[float] = None
    mass: Optional[float] = None
    driven: bool = False


@dataclasses.dataclass
class Found:
    """The contacts. `unexplained` is the share of the energy of the momentum that they leave: trust them below 0.001.
    `ambiguous` is the share of their impulse that other solutions, which explain the motion as well, do not have."""

    trace: Trace
    unexplained: float
    ambiguous: float
    report: str


def contacts(bodies: Mapping[str, Body], times: Sequence[float], poses: Mapping[str, tuple[Any, Any]], *,
             floor: Optional[float] = None, gravity: Sequence[float] = (0, 0, -9.81), friction: Optional[float] = None,
             force: bool = False, server: Optional[str] = None, program: str = "carillon") -> Found:
    """Finds the contacts that explain how `bodies` move. `poses` has for each body its positions in metres (F, 3) and
    orientations w, x, y, z (F, 4) at the `times` in seconds, which are equally far apart. `floor` is the height of an
    endless floor. The daemon at `server` makes the models of the bodies. Raises CarillonError, with the reasons of
    proto/errors.md, such as MOTION_UNEXPLAINED; with `force` only if nothing can be computed. Needs NumPy."""
    import numpy
    names = list(bodies)
    for name in sorted(bodies.keys() ^ poses.keys()):
        raise ValueError(f"{name!r} is in {'bodies' if name in bodies else 'poses'} alone; each body needs its poses, "
                         "and all poses need their body")
    words: list[str] = ["--gravity", ",".join(map(str, gravity))]
    with tempfile.TemporaryDirectory(prefix="carillon-") as name:
        folder = pathlib.Path(name)
        for number, (body_name, body) in enumerate(bodies.items()):
            mesh = folder / f"{number}.obj"
            vertices, triangles = body.surface
            mesh.write_text("".join("v %.9g %.9g %.9g\n" % tuple(vertex) for vertex in vertices)
                            + "".join("f %d %d %d\n" % tuple(i + 1 for i in face) for face in triangles))
            pattern = re.sub(r"([\\*?\[])", r"\\\1", body_name)
            words += ["--mesh", f"{pattern}={mesh}", "--material", f"{pattern}={body.material}"]
            words += [] if body.wall is None else ["--wall", f"{pattern}={body.wall}"]
            words += [] if body.mass is None else ["--mass", f"{pattern}={body.mass}"]
            words += ["--driven", pattern] if body.driven else []
        numpy.savez(folder / "poses.npz", times=numpy.asarray(times, float), bodies=numpy.array(names),
                    positions=numpy.stack([numpy.asarray(poses[n][0], float) for n in names], 1),
                    orientations=numpy.stack([numpy.asarray(poses[n][1], float) for n in names], 1))
        words += [] if floor is None else ["--floor", str(floor)]
        words += [] if friction is None else ["--friction", str(friction)]
        words += ["--force"] if force else []
        trace = folder / "found.contacts"
        try:
            report = programs.run(program, server, "foley", folder / "poses.npz", "--trace", trace, *words).stderr
        except CarillonError as error:
            message = error.message.replace(str(folder / "poses.npz"), "poses")
            for number, body_name in enumerate(names):
                message = message.replace(str(folder / f"{number}.obj"), f"the surface of {body_name}")
            raise CarillonError(error.reason, message) from None
        figures = re.search(r"unexplained (\S+) %, ambiguous (\S+) %", report)
        assert figures, report
        return Found(Trace.read(trace), float(figures[1]) / 100, float(figures[2]) / 100, report)
