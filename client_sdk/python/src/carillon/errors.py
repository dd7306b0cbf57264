# SPDX-License-Identifier: Apache-2.0
"""Refusals of the daemon as exceptions."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterable, Iterator

import grpc

from carillon.v1 import contact_pb2, error_pb2

DETAILS_KEY = "grpc-status-details-bin"


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


class ServerUnavailable(CarillonError):
    """No daemon answers at the address."""


class ContactWarning(UserWarning):
    """Contacts were rejected, or lie far from the surfaces of their objects."""


def warn_of_contacts(findings: contact_pb2.ContactFindings, rejected_count: int = 0,
                     last_rejection: error_pb2.ErrorInfo | None = None) -> None:
    """Warns of what is probably a mistake of the caller."""
    if rejected_count and last_rejection is not None:
        warnings.warn(f"{rejected_count} contacts were rejected, the last one with {last_rejection.reason}: "
                      f"{last_rejection.message}", ContactWarning, stacklevel=3)
    if findings.distant_point_count:
        warnings.warn(f"{findings.distant_point_count} contacts lie up to {findings.largest_distance_m:.3g} m away "
                      "from the surfaces of their objects and sound at the nearest points; give points in metres, in "
                      "the frame of the stream", ContactWarning, stacklevel=3)


def from_info(info: error_pb2.ErrorInfo) -> CarillonError:
    return CarillonError(info.reason, info.message, dict(info.metadata), info.remedies)


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
    return CarillonError(error.code().name, error.details() or "")


@contextlib.contextmanager
def translated(server: str) -> Iterator[None]:
    """Raises the errors of calls within the block as CarillonError."""
    try:
        yield
    except grpc.RpcError as error:
        raise from_rpc(error, server) from error
