# SPDX-License-Identifier: Apache-2.0
"""Programs that fork, such as those with a Pool of multiprocessing. gRPC keeps its threads in order over a fork only if
a variable of the environment says so when it is imported. With it, gRPC learns only at the next call that a connection
has ended, so that the first call after a restart of the daemon fails: the program that forks has to ask for it."""

from __future__ import annotations

import os
import weakref
from typing import Protocol

VARIABLE = "GRPC_ENABLE_FORK_SUPPORT"

_is_supported = os.environ.get(VARIABLE, "").lower() in ("1", "true", "yes", "y")


class Connection(Protocol):
    """What opens anew in a child, at its next call."""

    def forget(self) -> None: ...


_connections: weakref.WeakSet[Connection] = weakref.WeakSet()
_is_lost = False


def open_in_children(connection: Connection) -> None:
    """Has a connection opened anew in each process that this one forks."""
    refuse()
    _connections.add(connection)


def refuse() -> None:
    """Raises RuntimeError where calls of gRPC would never end."""
    if _is_lost:
        raise RuntimeError(f"this process was forked by one that was started without {VARIABLE}=1, so that its calls "
                           "would not end: set that variable before the program starts, or start processes by "
                           'multiprocessing.set_start_method("spawn")')


def _in_child() -> None:
    global _is_lost
    if not _is_supported and _connections:
        _is_lost = True
        return
    for connection in list(_connections):
        connection.forget()


os.register_at_fork(after_in_child=_in_child)
