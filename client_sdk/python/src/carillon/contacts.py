# SPDX-License-Identifier: Apache-2.0
"""Contacts, impulses and poses as arrays, and their way into the messages of a step."""

from __future__ import annotations

import dataclasses
from typing import Any, Optional, Union

import numpy
import numpy.typing

from carillon.v1 import contact_pb2

Array = numpy.typing.ArrayLike
PoseLike = Union[contact_pb2.Pose, Array, tuple[Array, Array]]


@dataclasses.dataclass
class Impulses:
    """Strikes, such as those of a hammer. All N rows belong together; a column that is None has its default.

    `objects` has the struck objects or their handles, `points` (N x 3, metres) and `impulses` (N x 3, newton seconds)
    are in the object's own frame, `durations` are seconds.
    """

    objects: Any
    points: Array
    impulses: Array
    durations: Optional[Array] = None
    time_offsets: Optional[Array] = None
    second_objects: Any = None
    second_points: Optional[Array] = None


@dataclasses.dataclass
class Contacts(Impulses):
    """Contacts as an engine reports them, all of one step: `impulses` are over the whole step, also at rest. The
    daemon separates impacts from loads for each pair of object and partner; `partners` are any numbers that name the
    other bodies."""

    partners: Any = None


@dataclasses.dataclass
class Poses:
    """Poses of objects: `positions` (N x 3, metres), and `orientations` (N x 4, quaternions w, x, y, z)."""

    objects: Any
    positions: Array
    orientations: Optional[Array] = None


def vector(values: Array) -> contact_pb2.Vec3:
    x, y, z = (float(value) for value in numpy.asarray(values, dtype=float).reshape(3))
    return contact_pb2.Vec3(x=x, y=y, z=z)


def to_pose(given: PoseLike) -> contact_pb2.Pose:
    """Accepts a position, a pair (position, quaternion w, x, y, z), and a 4 x 4 matrix."""
    if isinstance(given, contact_pb2.Pose):
        return given
    if isinstance(given, tuple) and len(given) == 2:
        w, x, y, z = (float(value) for value in numpy.asarray(given[1], dtype=float))
        return contact_pb2.Pose(position_m=vector(given[0]), orientation=contact_pb2.Quaternion(w=w, x=x, y=y, z=z))
    array = numpy.asarray(given, dtype=float)
    if array.shape == (4, 4):
        return to_pose((array[:3, 3], quaternion_of(array[:3, :3])))
    return contact_pb2.Pose(position_m=vector(array))


def quaternion_of(rotation: numpy.ndarray) -> numpy.ndarray:
    """The quaternion w, x, y, z of a rotation matrix: the eigenvector to the greatest eigenvalue of Bar-Itzhack's
    symmetric matrix, which also suits a matrix that is not quite orthogonal."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz = numpy.ravel(rotation)
    symmetric = numpy.array([[xx + yy + zz, zy - yz, xz - zx, yx - xy],
                             [zy - yz, xx - yy - zz, xy + yx, xz + zx],
                             [xz - zx, xy + yx, yy - xx - zz, yz + zy],
                             [yx - xy, xz + zx, yz + zy, zz - xx - yy]])
    quaternion: numpy.ndarray = numpy.linalg.eigh(symmetric)[1][:, 3]
    return quaternion if quaternion[0] >= 0 else -quaternion


def handles_of(objects: Any, count: int) -> numpy.ndarray:
    """Handles as a column; one object stands for all rows."""
    if isinstance(objects, numpy.ndarray):
        handles = objects
    else:
        handles = numpy.array([int(item) for item in numpy.atleast_1d(numpy.asarray(objects, dtype=object))])
    return numpy.broadcast_to(handles, (count,)).astype(numpy.uint32)


def _rows(values: Array, name: str, width: int = 3) -> numpy.ndarray:
    table = numpy.atleast_2d(numpy.asarray(values, dtype=float))
    if table.size == 0:
        return table.reshape(0, width)
    if table.ndim != 2 or table.shape[1] != width:
        raise ValueError(f"{name} has the shape {numpy.shape(values)}; it must be N x {width}")
    return table


def _numbers(values: Array, count: int) -> numpy.ndarray:
    return numpy.broadcast_to(numpy.asarray(values, dtype=float), (count,))


def fill_impulse_columns(columns: contact_pb2.ImpulseColumns, given: Impulses) -> int:
    """Copies the rows into the message and returns their number."""
    points = _rows(given.points, "points")
    impulses = _rows(given.impulses, "impulses")
    if len(points) != len(impulses):
        raise ValueError(f"there are {len(points)} points and {len(impulses)} impulses; each contact needs one of both")
    count = len(points)
    columns.object.extend(handles_of(given.objects, count).tolist())
    columns.point_m.extend(points.ravel().tolist())
    columns.impulse_newton_seconds.extend(impulses.ravel().tolist())
    if given.durations is not None:
        columns.duration_s.extend(_numbers(given.durations, count).tolist())
    if given.time_offsets is not None:
        columns.time_offset_s.extend(_numbers(given.time_offsets, count).tolist())
    if given.second_objects is not None:
        columns.second_object.extend(handles_of(given.second_objects, count).tolist())
        seconds = _rows(given.second_points if given.second_points is not None else (), "second_points")
        columns.second_point_m.extend(seconds.ravel().tolist())
    return count


def add_contacts(step: contact_pb2.ContactStep, given: Contacts) -> int:
    """Adds an engine's contacts to a step and returns their number."""
    columns = contact_pb2.ImpulseColumns()
    count = fill_impulse_columns(columns, given)
    partners = handles_of(given.partners if given.partners is not None else 0, count)
    for i, (x, y, z) in enumerate(zip(columns.point_m[0::3], columns.point_m[1::3], columns.point_m[2::3])):
        contact = step.contacts.add(object=columns.object[i], partner=int(partners[i]))
        contact.point_m.x, contact.point_m.y, contact.point_m.z = x, y, z
        impulse = contact.impulse_newton_seconds
        impulse.x, impulse.y, impulse.z = columns.impulse_newton_seconds[3 * i:3 * i + 3]
        if columns.duration_s:
            contact.duration_s = columns.duration_s[i]
        if columns.second_object and columns.second_object[i]:
            contact.second.object = columns.second_object[i]
            contact.second.point_m.CopyFrom(vector(columns.second_point_m[3 * i:3 * i + 3]))
    return count


def add_poses(step: contact_pb2.ContactStep, given: Poses) -> None:
    positions = _rows(given.positions, "positions")
    step.pose_columns.object.extend(handles_of(given.objects, len(positions)).tolist())
    step.pose_columns.position_m.extend(positions.ravel().tolist())
    if given.orientations is not None:
        step.pose_columns.orientation.extend(_rows(given.orientations, "orientations", 4).ravel().tolist())


def make_step(time: float, *, contacts: Optional[Contacts] = None, impulses: Optional[Impulses] = None,
              poses: Optional[Poses] = None, listener: Optional[PoseLike] = None) -> contact_pb2.ContactStep:
    """Makes the message of the step at a simulation time, seconds."""
    step = contact_pb2.ContactStep(time_s=time)
    if contacts is not None:
        add_contacts(step, contacts)
    if impulses is not None:
        fill_impulse_columns(step.columns, impulses)
    if poses is not None:
        add_poses(step, poses)
    if listener is not None:
        step.listener.CopyFrom(to_pose(listener))
    return step
