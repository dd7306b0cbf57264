# SPDX-License-Identifier: Apache-2.0
"""Refusals of the daemon as exceptions."""

from __future__ import annotations

import contextlib
import inspect
import re
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import grpc

from carillon.checks import counted
from carillon.v1 import contact_pb2, contact_service_pb2, error_pb2

SCENE_FRAME = "the scene's frame"
# Time by which a simulation in real time may run ahead.
USUAL_LEAD_S = 0.25
DETAILS_KEY = "grpc-status-details-bin"
# How gRPC ends a call whose message has more bytes than the daemon takes.
TOO_LARGE = re.compile(r"Received message larger than max \((\d+) vs\.? (\d+)\)")
# The caller's names of fields and calls of the contract that messages of the daemon mention.
CALLER_NAMES = {"step_s": "step", "scheduling_delay_s": "delay", "glide_s": "glide",
                r"columns(?=\[)": "impulses", r"contact_columns(?=\[)": "contacts", r"sustained(?=\[)": "forces",
                r"pose_columns(?=\[)": "poses", "SceneService.CreateScene": "Client.scene()"}


class CarillonError(Exception):
    """A refusal. `reason` is stable and one of proto/README.md's; `message` is a sentence that says what was wrong,
    where, and how to repair it; `metadata` has figures that belong to the reason; `remedies` are changes to the
    request that may help, the most promising first: each has a `field` of CreateModalModelRequest, a `value` in
    protobuf's text form (empty: the caller chooses), the command line's `option`, and its `effect` in words."""

    def __init__(self, reason: str, message: str, metadata: dict[str, str] | None = None,
                 remedies: Iterable[error_pb2.Remedy] = ()):
        super().__init__(f"{reason}: {message}")
        self.reason = reason
        self.message = message
        self.metadata = metadata or {}
        self.remedies = list(remedies)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.reason, self.message, self.metadata, self.remedies)


class ServerUnavailable(CarillonError):
    """No daemon answers at the address."""


class ContactWarning(UserWarning):
    """Contacts were late, lost or rejected, or lie far from the surfaces of their objects."""


class TransferWarning(UserWarning):
    """An object sounded before it was computed how it radiates, so that the same request will sound different."""


class UnitWarning(UserWarning):
    """A body is so large that its unit is likely to be wrong."""


class LabelWarning(UserWarning):
    """A model was there already, and has another label than the one that was asked for."""


def warn_of_label(label: str, wanted: str) -> None:
    """Warns of a model that was stored before, with the label `label` instead of `wanted`."""
    _warn(f"the model of this body is known as '{label}' and keeps this label, so that '{wanted}' does not name it; "
          "an object that names no material now gets the material of this request, so name one where you add "
          "the object", LabelWarning)


def warn_of_open_stream(scene: str) -> None:
    """Warns of a stream that was not closed before the program ended."""
    _warn(f"a stream of {scene} was not closed, so that its last contacts may not have sounded; close it, or use it as "
          "a context manager")


def warn_of_unit(extent_m: float) -> None:
    """Warns of a body whose box has the diagonal `extent_m`, metres."""
    _warn(f"the body is {extent_m:.3g} m across; if its coordinates are in another unit than metres, cancel and give "
          'the unit, such as unit="mm"', UnitWarning)


def warn_of_transfers(labels: Sequence[str]) -> None:
    """Warns of the jobs with these labels, whose transfers a rendering would have used."""
    jobs = ", ".join(labels)
    _warn(f"{jobs} {'is' if len(labels) == 1 else 'are'} still being computed, so that the sound is by the paper's "
          "coupling, and the same rendering will sound different later; call wait_for_transfer() of the model first",
          TransferWarning)


def warn_of_contacts(findings: contact_pb2.ContactFindings, frame: str, accepted_count: int = 0) -> None:
    """Warns of contacts that are probably a mistake of the caller. `frame` is that of their points, and
    `accepted_count` the number of impulses that sounded."""
    if findings.regular_gap_s:
        _warn(f"most steps came {findings.regular_gap_s:.3g} s apart, which is longer than the step that was stated, "
              "so that a body at rest strikes in each of them; state the step of the simulator and the times of steps "
              "in seconds")
    if count := findings.standing_step_count:
        _warn(f"{count} steps with contacts had the time of the step before; give each step the simulation's time, in "
              "seconds")
    if count := findings.changed_partner_count:
        _warn(f"in {count} steps an object in contact touched none of its partners of the step before, so that a body "
              "at rest strikes in each of them; give a body the same partner in each step, such as the engine's number "
              "of that body")
    if count := findings.fast_impulse_count:
        _warn(f"{counted(count, 'contact')} changed the speed of an object by up to "
              f"{findings.largest_speed_change_m_per_s:.3g} m/s; give impulses in newton seconds, which are forces "
              "times the step, and no forces")
    # The daemon counts an engine's contact without an impulse as a load, and it counts a strike with an impulse of zero
    # as accepted, once or twice for one or two objects.
    if findings.zero_impulse_count >= max(1, findings.load_count, accepted_count / 2) and not findings.blow_count:
        _warn(f"the impulse of {counted(findings.zero_impulse_count, 'contact')} was zero, and no other sounded; read "
              "impulses after the engine has solved its step, and give newton seconds")
    if count := findings.distant_point_count:
        _warn(f"{counted(count, 'contact')} {'lies' if count == 1 else 'lie'} up to "
              f"{findings.largest_distance_m:.3g} m away from the surfaces of the objects, and sound"
              f"{'s' if count == 1 else ''} at the nearest points; give points in metres, in {frame}"
              + (", and the pose of each object" if frame == SCENE_FRAME else ""))


def warn_of_stream(report: contact_service_pb2.StreamContactsResponse, frame: str, dropped_step_count: int = 0) -> None:
    """Warns, once and at the end of a stream, of the contacts that did not sound as the caller meant."""
    told = []
    if report.late_count:
        told.append(f"{_were(report.late_count, 'contact')} late, and sounded at once instead of at the right time: "
                    "send each step when it happens, or open the stream with a longer delay, in seconds (it was "
                    f"{report.scheduling_delay_s:.3g})")
    if report.remap_count:
        told.append(f"simulation time was mapped anew {counted(report.remap_count, 'time')}, because every step of a "
                    "quarter of a second was late: the simulator paused, or is slower than real time, for which "
                    "carillon.Trace suits")
    if report.ahead_s > report.scheduling_delay_s + USUAL_LEAD_S:
        told.append(f"the newest step sounds only in {report.ahead_s:.3g} s, because the simulation ran faster than "
                    "real time: send each step when it happens, keep the scene until then, or render a carillon.Trace")
    if report.dropped_count:
        told.append(f"{_were(report.dropped_count, 'contact')} lost, because too many waited for the mixer")
    if dropped_step_count:
        told.append(f"{_were(dropped_step_count, 'step')} not sent, because too many waited for the network")
    if report.rejected_count:
        told.append(f"{_were(report.rejected_count, 'contact')} rejected, the last one with "
                    f"{report.last_rejection.reason}: "
                    + report.last_rejection.message.replace("the object's frame", frame))
    if told:
        _warn("; ".join(told))
    warn_of_contacts(report.findings, frame, report.accepted_count + report.late_count)


def _warn(text: str, category: type[Warning] = ContactWarning) -> None:
    """Warns as of the line outside this package that has called it."""
    frame, level = inspect.currentframe(), 1
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "carillon":
        frame, level = frame.f_back, level + 1
    warnings.warn(text, category, stacklevel=level)


def _were(count: int, noun: str) -> str:
    return f"{counted(count, noun)} {'was' if count == 1 else 'were'}"


def in_names_of_caller(text: str, names: Mapping[str, str]) -> str:
    """Replaces names of the contract by those of the caller, and adds the unit, seconds, that the name loses."""
    for field, name in names.items():
        text = re.sub(rf"\b{field} is (\S+); it must be (\S+) to (\S+)", rf"{name} is \1 s; it must be \2 to \3 s",
                      text)
        text = re.sub(rf"\b{field} is (\S+);", rf"{name} is \1 s;", text)
        text = re.sub(rf"\b{field}\b", name, text)
    return text


def _argument_of(remedy: error_pb2.Remedy) -> str:
    """A remedy as an argument of create_model, such as settings={"mesh": {"repair": True}}."""
    name, *inner = remedy.field.split(".")
    value = {"true": "True", "false": "False"}.get(remedy.value, remedy.value)
    for field in reversed(inner):
        value = f'{{"{field}": {value}}}'
    return f"{name}={value}"


def from_info(info: error_pb2.ErrorInfo) -> CarillonError:
    text = in_names_of_caller(info.message, CALLER_NAMES)
    if info.remedies and info.remedies[0].value:
        text += f"; it may help to call create_model with {_argument_of(info.remedies[0])}"
    return CarillonError(info.reason, text, dict(info.metadata), info.remedies)


def from_rpc(error: grpc.RpcError, server: str) -> CarillonError:
    """Converts the error of a call; its rich status is in the trailing metadata."""
    for key, value in error.trailing_metadata() or ():
        if key == DETAILS_KEY:
            info = error_pb2.ErrorInfo()
            details = error_pb2.StatusDetails.FromString(value)
            if any(detail.Unpack(info) for detail in details.details):
                return from_info(info)
    if error.code() == grpc.StatusCode.UNAVAILABLE:
        return ServerUnavailable("SERVER_UNAVAILABLE", f"no daemon answers at {server}: {error.details()}; start "
                                 "carillond, or give the address where it listens")
    if too_large := TOO_LARGE.match(error.details() or ""):
        return CarillonError("MESSAGE_TOO_LARGE", f"a message of {too_large[1]} bytes: the daemon takes at most "
                             f"{too_large[2]}; report fewer points in a step, or ask for less in one call")
    return CarillonError(error.code().name, error.details() or "")


@contextlib.contextmanager
def translated(server: str) -> Iterator[None]:
    """Raises the errors of calls within the block as CarillonError."""
    try:
        yield
    except grpc.RpcError as error:
        raise from_rpc(error, server) from error


@contextlib.contextmanager
def in_names(**names: str) -> Iterator[None]:
    """Raises a refusal within the block with the caller's names of fields of the contract."""
    try:
        yield
    except CarillonError as error:
        message = in_names_of_caller(error.message, names)
        raise type(error)(error.reason, message, error.metadata, error.remedies) from error.__cause__
