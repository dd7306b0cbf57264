# SPDX-License-Identifier: Apache-2.0
"""Contacts and poses as arrays, and their way into the messages of a step."""

from __future__ import annotations

import dataclasses
import numbers
import operator
from collections.abc import Iterator
from typing import Any, Literal, Optional, Union

import numpy
import numpy.typing

from carillon import checks, errors
from carillon.columns import append
from carillon.v1 import contact_pb2

Array = numpy.typing.ArrayLike
PoseLike = Union[contact_pb2.Pose, Array, tuple[Array, Array]]
Striker = Union[None, str, contact_pb2.HertzContact]
Frame = Literal["object", "scene"]
PulseShape = Literal["raised_cosine", "gaussian"]

# A duration that is below zero in a column is absent.
ABSENT = -1.0
# The largest magnitude of the time of a step, as contact.proto says.
LARGEST_TIME_S = 1e10

# What the arguments mean, for messages.
STREAM_FRAME = "in the stream's frame, which is each object's own unless it was opened with frame=\"scene\""
ROTATION = "a quaternion w, x, y, z of length 1"
MEANINGS = {
    "points": f"metres {STREAM_FRAME}", "second_points": "metres in the second object's own frame, or in the "
    "scene's in a stream with frame=\"scene\"",
    "impulses": f"newton seconds {STREAM_FRAME}", "forces": f"newtons {STREAM_FRAME}",
    "second_rotations": f"{ROTATION} from the first object's frame into the second's",
    "normals": "perpendicular to the surfaces that touch, of any length, in the frame of the impulses",
    "positions": "metres in the scene's frame",
    "orientations": f"{ROTATION} from the object's frame into the scene's",
    "durations": "seconds", "time_offsets": "seconds after the step's time", "travel_speeds": "m/s"}
OBJECT_POINT, OBJECT_IMPULSE = "metres in the object's own frame", "newton seconds in the object's own frame"
POSE = ("a position x, y, z in metres, a pair (position, quaternion w, x, y, z), or a 4 x 4 matrix, all in the scene's "
        "frame")
# Handles and partners have 32 bits in the contract.
OBJECT = ("an object that Scene.add or Trace.add returned, or its handle, a whole number from 0 to "
          f"{checks.MOST_OF_32_BITS}")
PARTNER = (f"a whole number from 0 to {checks.MOST_OF_32_BITS} that names the other body, such as its place in your "
           "list of bodies")
TIME_SCALE = "simulation time over time of the sound, 0.001 to 1000, or 0 in a pause"
DURATION = "zero seconds or more, or NaN, which leaves it to the daemon"
STRIKER_FIGURES = ("mass_kg", "radius_m", "young_pa", "poisson_ratio")


# Columns of one number a contact that are copied as they are, and their fields in ContactColumns.
NUMBERS = {"time_offsets": "time_offset_s", "travel_speeds": "travel_speed_m_per_s"}


@dataclasses.dataclass
class _Impulses:
    """The columns that impacts and reported contacts have in common."""

    objects: Any
    points: Array
    impulses: Array
    durations: Optional[Array] = None
    time_offsets: Optional[Array] = None
    second_objects: Any = None
    second_points: Optional[Array] = None
    second_rotations: Optional[Array] = None
    striker: Striker = None
    environments: Any = None
    normals: Optional[Array] = None


@dataclasses.dataclass
class Impacts(_Impulses):
    """Blows that you intend, such as those of a hammer. All N rows belong together; a column that is None has its
    default.

    `objects` has the struck objects or their handles; one object stands for all rows. `points` (N x 3, metres) and
    `impulses` (N x 3, newton seconds) are in the frame of the stream, by default each object's own. `durations` are
    seconds, zero or more; NaN leaves one to the daemon, which computes it from the object and from `striker`.
    `time_offsets` are seconds from the step's time to the impact. `second_objects` has the objects that struck, zero
    for none. `second_points` (N x 3, metres) are the same places in each second object's own frame; in a stream with
    frame="scene" they are in the scene's frame, and by default the points. `second_rotations` (N x 4, quaternions
    w, x, y, z) rotate from the first object's frame into the second's. `environments` are those of a performance, by
    their index. `normals` (N x 3, of any length, zero for none), in the frame of the impulses, are perpendicular to the
    surfaces that touch; with them friction does not shorten an impact."""


@dataclasses.dataclass
class Contacts(_Impulses):
    """Contacts as an engine reports them, all of one step: `impulses` are over the whole step, also at rest. The
    daemon tells impacts from resting contacts for each pair of object and partner; `partners` are whole numbers from 0
    to 4294967295 that name the other bodies. `travel_speeds` (m/s) with which a contact slides or rolls make it sound
    rough, by `roughness_depth` and `irregularity_length` (metres), as Roughness in contact.proto says."""

    partners: Any = None
    travel_speeds: Optional[Array] = None
    roughness_depth: float = 0
    irregularity_length: float = 0


@dataclasses.dataclass
class ContactForces:
    """Contact forces, of a simulator that separates resting contacts from impacts itself: `forces` (N x 3, newtons) at
    the step's time. The other columns are those of Contacts."""

    objects: Any
    points: Array
    forces: Array
    second_objects: Any = None
    second_points: Optional[Array] = None
    second_rotations: Optional[Array] = None
    travel_speeds: Optional[Array] = None
    roughness_depth: float = 0
    irregularity_length: float = 0
    environments: Any = None


@dataclasses.dataclass
class Poses:
    """Poses of objects: `positions` (N x 3, metres), and `orientations` (N x 4, quaternions w, x, y, z)."""

    objects: Any
    positions: Array
    orientations: Optional[Array] = None
    environments: Any = None


def striker(name: str = "", **figures: float) -> contact_pb2.HertzContact:
    """Describes the body that strikes: a named one, such as "wood", or a floor of a material, such as "concrete", with
    figures that override those of the named one, or figures alone. They are mass_kg, radius_m, young_pa and
    poisson_ratio of the striker, approach_speed_m_per_s, reduced_mass_kg and reduced_radius_m."""
    own = {f"striker_{key}": figures.pop(key) for key in STRIKER_FIGURES if key in figures}
    checks.refuse_unknown(figures, [*STRIKER_FIGURES, "approach_speed_m_per_s", "reduced_mass_kg", "reduced_radius_m"],
                          "striker")
    return checks.message(contact_pb2.HertzContact, "striker", {"striker": name, **own, **figures})


def to_hertz(given: Striker) -> Optional[contact_pb2.HertzContact]:
    if given is None or isinstance(given, contact_pb2.HertzContact):
        return given
    if not isinstance(given, str):
        raise TypeError(f"striker is of type {type(given).__name__}; it must be a name such as \"wood\", or "
                        "carillon.striker(...)")
    return contact_pb2.HertzContact(striker=given)


def to_frame(name: Optional[Frame]) -> contact_pb2.Frame:
    return checks.choice(contact_pb2.Frame, "FRAME_", "frame", name)


def to_pulse_shape(name: Optional[PulseShape]) -> contact_pb2.PulseShape:
    return checks.choice(contact_pb2.PulseShape, "PULSE_SHAPE_", "pulse_shape", name)


def vector(values: Array) -> contact_pb2.Vec3:
    x, y, z = (float(value) for value in numpy.asarray(values, dtype=float).reshape(3))
    return contact_pb2.Vec3(x=x, y=y, z=z)


def to_pose(given: PoseLike, name: str = "pose") -> contact_pb2.Pose:
    """Accepts a position, a pair (position, quaternion w, x, y, z), and a 4 x 4 matrix. Raises ValueError that names
    the argument."""
    if isinstance(given, contact_pb2.Pose):
        return given
    if isinstance(given, tuple) and len(given) == 2 and numpy.ndim(given[0]) > 0:
        position = checks.three(given[0], f"the position of {name}", "metres in the scene's frame")
        rotation = checks.numbers(given[1], f"the orientation of {name}", ROTATION)
        if rotation.shape != (4,):
            checks.refuse(given[1], f"the orientation of {name}", ROTATION)
        w, x, y, z = rotation.tolist()
        return contact_pb2.Pose(position_m=vector(position), orientation=contact_pb2.Quaternion(w=w, x=x, y=y, z=z))
    array = checks.numbers(given, name, POSE)
    if array.shape == (4, 4):
        return to_pose((array[:3, 3], quaternion_of(array[:3, :3])))
    if array.size != 3:
        checks.refuse(given, name, POSE)
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


def handles_of(objects: Any, count: int, name: str = "objects", wanted: str = OBJECT) -> numpy.ndarray:
    """Handles, or partners, as a column of 32 bits; one object stands for all rows. Raises TypeError or ValueError that
    shows the entry which is no such number."""
    if isinstance(objects, numpy.ndarray) and objects.dtype.kind in "iuf":
        handles = objects
    else:
        items = numpy.asarray(objects, dtype=object)
        handles = numpy.array([_handle_of(item, name, wanted) for item in items.ravel()]).reshape(items.shape)
    return _column(checks.whole_numbers(handles, name, wanted), count, name)


def _handle_of(item: Any, name: str, wanted: str) -> Any:
    try:
        return operator.index(item)
    except TypeError:
        if isinstance(item, numbers.Real):
            return item
        checks.refuse(item, f"an entry of {name}", wanted, TypeError)


def _rows(values: Array, name: str, width: int = 3, count: Optional[int] = None) -> numpy.ndarray:
    """A table with `width` columns, and with `count` rows unless that is None."""
    table = numpy.atleast_2d(checks.numbers(values, name, MEANINGS[name]))
    if table.size == 0:
        table = table.reshape(0, width)
    if table.ndim != 2 or table.shape[1] != width:
        raise ValueError(f"{name} has the shape {numpy.shape(values)}; it must be N x {width}: {MEANINGS[name]}")
    if count is not None and len(table) != count:
        raise ValueError(f"{name} has {checks.counted(len(table), 'row')}; it must have {count}, as the points or "
                         "positions have")
    return table


def _column(values: numpy.ndarray, count: int, name: str) -> numpy.ndarray:
    if values.shape not in ((), (count,)):
        raise ValueError(f"{name} has the shape {values.shape}; it must be ({count},), one for each row, or a number "
                         "for all")
    return numpy.broadcast_to(values, (count,))


def _numbers(values: Array, count: int, name: str) -> numpy.ndarray:
    return _column(checks.numbers(values, name, MEANINGS[name]), count, name)


def _pairs(points: Array, vectors: Array, name: str) -> tuple[numpy.ndarray, numpy.ndarray]:
    """The points, and the impulses or forces there, as tables of equal length."""
    places, values = _rows(points, "points"), _rows(vectors, name)
    if len(places) != len(values):
        raise ValueError(f"points has {checks.counted(len(places), 'row')} and {name} has {len(values)}; each contact "
                         "needs one of both")
    return places, values


def add_contacts(step: contact_pb2.ContactStep, given: Union[_Impulses, ContactForces], frame: int) -> int:
    """Adds contacts of one kind, in a Frame, to a step and returns their number."""
    _refuse_environments(given)
    return fill_columns(step.contact_columns.add(), given, frame)


def _refuse_environments(given: Any) -> None:
    if given.environments is not None:
        raise ValueError("environments are those of a performance (Client.perform); a stream or a trace has none")


def fill_columns(columns: contact_pb2.ContactColumns, given: Union[_Impulses, ContactForces], frame: int) -> int:
    """Fills in the columns of contacts of one kind, in a Frame, and returns their number."""
    is_force = isinstance(given, ContactForces)
    points, vectors = _pairs(given.points, given.forces if isinstance(given, ContactForces) else given.impulses,
                             "forces" if is_force else "impulses")
    columns.kind, count = _kind_of(given), len(points)
    append(columns, object=handles_of(given.objects, count), point_m=points,
           **{"force_newtons" if is_force else "impulse_newton_seconds": vectors})
    for name, field in NUMBERS.items():
        values = getattr(given, name, None)
        if values is not None:
            append(columns, **{field: _numbers(values, count, name)})
    if isinstance(given, _Impulses):
        _fill_collision_columns(columns, given, count)
    if isinstance(given, Contacts) and given.partners is not None:
        append(columns, partner=handles_of(given.partners, count, "partners", PARTNER))
    if isinstance(given, (Contacts, ContactForces)):
        columns.roughness_depth = given.roughness_depth
        columns.irregularity_length_m = given.irregularity_length
    if given.second_objects is not None:
        _fill_second_columns(columns, given, points, frame)
    return count


def _kind_of(given: Union[_Impulses, ContactForces]) -> contact_pb2.ContactKind:
    if isinstance(given, Contacts):
        return contact_pb2.CONTACT_KIND_REPORTED
    return contact_pb2.CONTACT_KIND_IMPACT if isinstance(given, Impacts) else contact_pb2.CONTACT_KIND_FORCE


def _fill_collision_columns(columns: contact_pb2.ContactColumns, given: _Impulses, count: int) -> None:
    if given.durations is not None:
        durations = _numbers(given.durations, count, "durations")
        if (durations < 0).any():
            checks.refuse(durations[durations < 0].tolist()[0], "an entry of durations", DURATION)
        append(columns, duration_s=numpy.where(numpy.isnan(durations), ABSENT, durations))
    if given.normals is not None:
        append(columns, normal=_rows(given.normals, "normals", 3, count))
    if given.striker is not None:
        columns.hertz.CopyFrom(to_hertz(given.striker))


def _fill_second_columns(columns: contact_pb2.ContactColumns, given: Union[_Impulses, ContactForces],
                         points: numpy.ndarray, frame: int) -> None:
    count = len(points)
    if given.second_points is not None:
        points = _rows(given.second_points, "second_points", 3, count)
    elif frame != contact_pb2.FRAME_SCENE:  # there one place has the same coordinates for both objects
        raise ValueError("second_objects without second_points: each contact needs its place in the frame of its "
                         "second object, too, unless the frame is \"scene\"")
    append(columns, second_object=handles_of(given.second_objects, count, "second_objects"), second_point_m=points)
    if given.second_rotations is not None:
        append(columns, second_rotation=_rows(given.second_rotations, "second_rotations", 4, count))


def strike_of(item: Any, point: Array, impulse: Array, duration: Optional[float], struck_by: Striker) -> Impacts:
    """One strike. Raises ValueError if it has not one point and one impulse, if the impulse is zero, or if the duration
    is negative."""
    if duration is not None and checks.numbers(duration, "duration", DURATION) < 0:
        checks.refuse(duration, "duration", DURATION)
    vector_of_impulse = checks.three(impulse, "impulse", OBJECT_IMPULSE)
    if not vector_of_impulse.any():
        checks.refuse(impulse, "impulse",
                      f"other than zero, because the strike would be silent: x, y, z, {OBJECT_IMPULSE}")
    return Impacts(item, checks.three(point, "point", OBJECT_POINT), vector_of_impulse, durations=duration,
                   striker=struck_by)


def add_poses(step: contact_pb2.ContactStep, given: Poses) -> None:
    _refuse_environments(given)
    fill_pose_columns(step.poses, given)


def fill_pose_columns(columns: contact_pb2.PoseColumns, given: Poses) -> int:
    """Fills in the columns of poses and returns their number."""
    positions = _rows(given.positions, "positions")
    append(columns, object=handles_of(given.objects, len(positions)), position_m=positions)
    if given.orientations is not None:
        append(columns, orientation=_rows(given.orientations, "orientations", 4, len(positions)))
    return len(positions)


def scenes_of_objects(columns: Any) -> Iterator[tuple[str, str]]:
    """Yields, for each object of a scene among the columns, the name of its column and that of the scene."""
    for name in ("objects", "second_objects"):
        given = getattr(columns, name, None)
        for item in given if isinstance(given, (list, tuple)) else [given]:
            scene = getattr(item, "scene", None)
            if scene is not None:
                yield name, scene.name


def refuse_time(time: float, number: int, before: float, repair: str) -> None:
    """Raises CarillonError (INVALID_STREAM) if step `number` of a run, counted from zero, cannot have the time after
    that of the step before, both in seconds. `repair` says what another run needs."""
    if not abs(time) <= LARGEST_TIME_S:
        raise errors.CarillonError("INVALID_STREAM", f"the time of step {number} is {time}; give the simulation time "
                                   f"in seconds, at most {LARGEST_TIME_S:.0e} before or after 0")
    if number and time < before:
        raise errors.CarillonError("INVALID_STREAM", f"time goes back from {before:.15g} s to {time:.15g} s at step "
                                   f"{number}; {repair}")


def checked_scale(scale: Optional[float]) -> Optional[float]:
    """The scale of a step's time. Raises ValueError if it is not one."""
    if scale is not None and checks.number(scale, "time_scale", TIME_SCALE) and not 0.001 <= scale <= 1000:
        checks.refuse(scale, "time_scale", TIME_SCALE)
    return scale


def make_step(time: float, *, contacts: Optional[Contacts] = None, impacts: Optional[Impacts] = None,
              forces: Optional[ContactForces] = None, poses: Optional[Poses] = None,
              listener: Optional[PoseLike] = None, time_scale: Optional[float] = None,
              frame: int = contact_pb2.FRAME_OBJECT) -> contact_pb2.ContactStep:
    """Makes the message of the step at a simulation time, seconds, of a stream or trace with this Frame."""
    step = contact_pb2.ContactStep(time_s=checks.number(time, "time", "the simulation time in seconds"),
                                   time_scale=checked_scale(time_scale))
    for name, given, kind in (("contacts", contacts, Contacts), ("impacts", impacts, Impacts),
                              ("forces", forces, ContactForces)):
        if given is not None:
            checks.expect(given, kind, name)
            add_contacts(step, given, frame)
    if poses is not None:
        checks.expect(poses, Poses, "poses")
        add_poses(step, poses)
    if listener is not None:
        step.listener.CopyFrom(to_pose(listener, "listener"))
    return step
