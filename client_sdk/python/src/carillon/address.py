# SPDX-License-Identifier: Apache-2.0
"""Where the daemon listens unless the caller says otherwise."""

import contextlib
import ipaddress
import os
import pathlib
import re
import sys

SYSTEM_SOCKET = pathlib.Path("/run/carillon/carillond.sock")


def default_server() -> str:
    """Returns $CARILLON_SERVER; otherwise the socket of the user's own daemon, or, where there is none, that of the
    machine's daemon. Windows has no such sockets: there a daemon in a container or a tunnel answers at loopback."""
    if named := os.environ.get("CARILLON_SERVER"):
        return named
    if sys.platform == "win32":
        return "127.0.0.1:50051"
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    folder = pathlib.Path(runtime, "carillon") if runtime else pathlib.Path(f"/tmp/carillon-{os.getuid()}")
    own = folder / "carillond.sock"
    try:
        use_system = not own.exists() and SYSTEM_SOCKET.exists()
    except PermissionError:
        use_system = False
    return f"unix:{SYSTEM_SOCKET if use_system else own}"


def is_local(server: str) -> bool:
    """Whether nothing that is sent to the address leaves this machine: a Unix socket, or an address of loopback."""
    if server.startswith(("unix:", "unix-abstract:")):
        return True
    host = re.sub(r"^(dns|ipv4|ipv6):(//[^/]*/)?", "", server).rpartition(":")[0].strip("[]")
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host).is_loopback
    return host == "localhost"
