# SPDX-License-Identifier: Apache-2.0
"""Refusals of the daemon as exceptions."""

from __future__ import annotations

import contextlib
import inspect
import re
import warnings
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import grpc

from carillon.v1 import error_pb2, warning_pb2

DETAILS_KEY = "grpc-status-details-bin"
# How gRPC ends a call whose message has more bytes than the daemon takes.
TOO_LARGE = re.compile(r"Received message larger than max \((\d+) vs\.? (\d+)\)")


class CarillonError(Exception):
    """A refusal. `reason` is stable and one of proto/errors.md's; `message` is a sentence that says what was wrong,
    where, and how to repair it; `metadata` has figures that belong to the reason; `remedies` are changes to the
    request that may help, the most promising first: each has a `field` of CreateModalModelRequest, a `value` in
    protobuf's text form (empty: the caller chooses), the command line's `option`, and its `effect` in words.
    `performed` are the samples and impacts of a step of a performance of which a part was rejected, else None."""

    performed: Any = None

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
    """Contacts probably do not sound as they were meant: they were late, lost or rejected, lie far from their objects,
    and the like. `id` is stable and one of proto/errors.md's; `count` is the number of contacts or steps, and `figures`
    belong to the warning."""

    def __init__(self, warning: warning_pb2.Warning):
        super().__init__(warning)
        self.id, self.count, self.figures = warning.id, warning.count, dict(warning.figures)
        self.text = warning.text

    def __str__(self) -> str:
        return f"{self.id}: {self.text}"


class TransferWarning(UserWarning):
    """An object sounds before it is computed how it radiates, so that it will sound different later."""


class HearingWarning(UserWarning):
    """A scene is to be heard from left and right, and the daemon plays one channel."""


class LabelWarning(UserWarning):
    """A model was there already, and has another label than the one that was asked for."""


def warn_of_label(label: str, wanted: str) -> None:
    """Warns of a model that was stored before, with the label `label` instead of `wanted`."""
    _warn(f"the model of this body is known as '{label}' and keeps this label, so that '{wanted}' does not name it; "
          "an object that names no material now gets the material of this request, so name one where you add "
          "the object", LabelWarning)


def warn_of_one_channel(scene: str) -> None:
    """Warns of a scene with panning or two ears whose daemon plays one channel."""
    _warn(f"{scene} has panning or two ears, but the daemon plays one channel, which has neither; start it by "
          "`carillond --channels 2`", HearingWarning)


def warn_of_open_stream(scene: str) -> None:
    """Warns of a stream that was not closed before the program ended."""
    _warn(ContactWarning(warning_pb2.Warning(
        id="STREAM_NOT_CLOSED", text=f"a stream of {scene} was not closed, so that its last contacts may not have "
        "sounded; close it, or use it as a context manager")))


def warn_of_transfers(labels: Sequence[str], meanwhile: str) -> None:
    """Warns of the jobs with these labels, whose transfers the objects lack, and says how these sound meanwhile."""
    jobs = ", ".join(labels)
    _warn(f"{jobs} {'is' if len(labels) == 1 else 'are'} still being computed, so that {meanwhile}; call "
          "wait_for_transfer() of the model first", TransferWarning)


def warn_of_contacts(told: Iterable[warning_pb2.Warning]) -> None:
    """Passes on what the daemon says about contacts that are probably a mistake of the caller."""
    for warning in told:
        _warn(ContactWarning(warning))


def _warn(told: str | Warning, category: type[Warning] = UserWarning) -> None:
    """Warns as of the line outside this package that has called it."""
    frame, level = inspect.currentframe(), 1
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "carillon":
        frame, level = frame.f_back, level + 1
    warnings.warn(told, category, stacklevel=level)


def from_info(info: error_pb2.ErrorInfo) -> CarillonError:
    text = info.message
    if info.remedies and info.remedies[0].value:
        text += f"; it may help to set {info.remedies[0].field} to {info.remedies[0].value}"
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
        raise from_rpc(error, server) from None  # gRPC's traceback says nothing more
