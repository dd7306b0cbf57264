# SPDX-License-Identifier: Apache-2.0
"""Contact traces: recorded simulations that are rendered later (.contacts files)."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, BinaryIO, Optional

from google.protobuf.message import DecodeError

from carillon import checks, contacts, materials
from carillon.columns import varint
from carillon.contacts import (
    ContactForces, Contacts, Impacts, PoseLike, Poses, make_step, refuse_time, scenes_of_objects)
from carillon.errors import CarillonError
from carillon.v1 import contact_pb2, contact_trace_pb2, hearing_pb2

FORMAT_VERSION = 1


class Trace:
    """A trace in memory: `header`, `objects` and `steps` are the messages of contact_trace.proto. `step`, the length of
    the simulator's steps in seconds, is needed for all but impacts: by it the daemon knows whether a step was left
    out, and so when a blow is over. A rendering dates each blow as a stream does, which adds its scheduling delay.
    `labels` are text of your own by name, such as {"class": "glass"}, which `carillon render` copies into the record
    of the sound."""

    def __init__(self, step: float = 0, *, simulator: str = "", hearing: Optional[hearing_pb2.Hearing] = None,
                 listener: Optional[PoseLike] = None, frame: Optional[contacts.Frame] = None,
                 pulse_shape: Optional[contacts.PulseShape] = None, labels: Optional[Mapping[str, str]] = None):
        self.header = contact_trace_pb2.ContactTraceHeader(
            format_version=FORMAT_VERSION, simulator=simulator, step_s=step, hearing=hearing,
            listener=None if listener is None else contacts.to_pose(listener, "listener"),
            frame=contacts.to_frame(frame), pulse_shape=contacts.to_pulse_shape(pulse_shape), labels=labels)
        self.objects: list[contact_trace_pb2.ContactTraceObject] = []
        self.steps: list[contact_pb2.ContactStep] = []

    def add(self, model: materials.ModelLike | str, material: Optional[materials.Material] = None, *, size: float = 1,
            gain: float = 1, pose: Optional[PoseLike] = None, label: str = "", handle: Optional[int] = None,
            radiation: Optional[materials.Radiation] = None) -> int:
        """Adds an object, which is there from the beginning, with a linear `gain`. Returns its handle."""
        handle = handle or 1 + max((item.handle for item in self.objects), default=0)
        name, message = materials.named(model, material)
        self.objects.append(checks.message(contact_trace_pb2.ContactTraceObject, "add", dict(
            handle=handle, modal_model=name, material=message, size=size, gain=gain, label=label,
            pose=None if pose is None else contacts.to_pose(pose), radiation=materials.to_radiation(radiation))))
        return handle

    def step(self, time: float, *, contacts: Optional[Contacts] = None, impacts: Optional[Impacts] = None,
             forces: Optional[ContactForces] = None, poses: Optional[Poses] = None,
             listener: Optional[PoseLike] = None, time_scale: Optional[float] = None) -> None:
        """Adds a step, as ContactStream.step sends one. Raises CarillonError (INVALID_STREAM) and adds nothing if the
        time goes back, or is over 1e10 s before or after 0. A trace without a clock can be rendered if its times are 0
        to 86400 s."""
        if not self.header.step_s and any(item is not None for item in (contacts, forces, poses)):
            raise ValueError("contacts, forces and poses need the length of the simulator's steps in seconds, as in a "
                             "stream: Trace(step=1/240)")
        for columns in (contacts, impacts, forces, poses):
            _refuse_objects_of_scenes(columns)
        made = make_step(time, contacts=contacts, impacts=impacts, forces=forces, poses=poses, listener=listener,
                         time_scale=time_scale, frame=self.header.frame)
        refuse_time(made.time_s, len(self.steps), self.steps[-1].time_s if self.steps else 0,
                    "make another trace for another run")
        self.steps.append(made)

    def __repr__(self) -> str:
        return (f"<Trace: {checks.counted(len(self.objects), 'object')}, {checks.counted(len(self.steps), 'step')}, to "
                f"{self.steps[-1].time_s if self.steps else 0:.6g} s>")

    def records(self) -> Iterator[contact_trace_pb2.ContactTraceRecord]:
        """The header, the objects, then the steps."""
        record = contact_trace_pb2.ContactTraceRecord
        yield record(header=self.header)
        yield from (record(object=item) for item in self.objects)
        yield from (record(step=item) for item in self.steps)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes a .contacts file."""
        with open(path, "wb") as file:
            for record in self.records():
                data = record.SerializeToString(deterministic=True)
                file.write(varint(len(data)) + data)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Trace:
        """Reads a .contacts file. Raises CarillonError (TRACE_MALFORMED, TRACE_TOO_NEW)."""
        with open(path, "rb") as file:
            return cls.of(_read_records(file, str(path)), str(path))

    @classmethod
    def of(cls, records: Iterable[contact_trace_pb2.ContactTraceRecord], source: str = "the trace") -> Trace:
        """Makes a trace of its records. Raises CarillonError (TRACE_MALFORMED, TRACE_TOO_NEW)."""
        remaining = iter(records)
        trace = cls()
        trace.header = next(remaining, contact_trace_pb2.ContactTraceRecord()).header
        cls._check_version(trace.header.format_version, source)
        for number, record in enumerate(remaining, 1):
            kind = record.WhichOneof("record")
            if kind == "object":
                trace.objects.append(record.object)
            elif kind == "step":
                trace.steps.append(record.step)
            elif kind == "header":
                raise CarillonError("TRACE_MALFORMED", f"{source}: record {number} must not be a header")
            else:
                raise CarillonError("TRACE_MALFORMED", f"{source}: record {number} is of no known kind; update this "
                                    "program, or write the trace again")
        return trace

    @staticmethod
    def _check_version(version: int, source: str) -> None:
        if version == 0:
            raise CarillonError("TRACE_MALFORMED", f"{source} does not begin with the header of a contact trace; write "
                                "the trace again")
        if version > FORMAT_VERSION:
            raise CarillonError("TRACE_TOO_NEW", f"{source} has format version {version}, this program reads "
                                f"{FORMAT_VERSION}; update it")


def _refuse_objects_of_scenes(columns: Any) -> None:
    """Raises ValueError for an object of a scene, whose handle may mean another object in the trace."""
    for name, scene in scenes_of_objects(columns):
        raise ValueError(f"{name} has an object of {scene}, which is not in the trace; give what Trace.add returned")


def _read_varint(file: BinaryIO) -> Optional[int]:
    """Returns None at the end of the file."""
    value = shift = 0
    while byte := file.read(1):
        value |= (byte[0] & 0x7F) << shift
        if byte[0] < 0x80:
            return value
        shift += 7
        if shift > 63:
            raise EOFError
    if shift:
        raise EOFError
    return None


def _read_records(file: BinaryIO, path: str) -> Iterator[contact_trace_pb2.ContactTraceRecord]:
    number = 0
    most = os.fstat(file.fileno()).st_size
    try:
        while (size := _read_varint(file)) is not None:
            data = file.read(min(size, most))
            if len(data) < size:
                raise EOFError
            yield contact_trace_pb2.ContactTraceRecord.FromString(data)
            number += 1
    except (EOFError, DecodeError) as error:
        raise CarillonError("TRACE_MALFORMED", f"{path}: record {number} is cut off or damaged; write the trace "
                            "again") from error
