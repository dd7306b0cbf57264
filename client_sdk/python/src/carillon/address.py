# SPDX-License-Identifier: Apache-2.0
"""Where the daemon listens unless the caller says otherwise."""

import os
import pathlib

SYSTEM_SOCKET = pathlib.Path("/run/carillon/carillond.sock")


def default_server() -> str:
    """Returns $CARILLON_SERVER; otherwise the socket of the user's own daemon, or, where there is none, that of the
    machine's daemon."""
    if named := os.environ.get("CARILLON_SERVER"):
        return named
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    folder = pathlib.Path(runtime, "carillon") if runtime else pathlib.Path(f"/tmp/carillon-{os.getuid()}")
    own = folder / "carillond.sock"
    try:
        use_system = not own.exists() and SYSTEM_SOCKET.exists()
    except PermissionError:
        use_system = False
    return f"unix:{SYSTEM_SOCKET if use_system else own}"
