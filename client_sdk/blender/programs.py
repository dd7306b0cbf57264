# SPDX-License-Identifier: Apache-2.0
"""The programs of Carillon that the add-on runs: `carillon`, and `carillond` where none answers."""

import contextlib
import ctypes
import os
import shutil
import signal
import subprocess
import tempfile
import threading


class Fault(Exception):
    """A failure with its name (proto/errors.md, and those of docs/blender.md), and the objects concerned."""

    def __init__(self, reason, message, bodies=()):
        super().__init__(f"{reason}: {message}")
        self.reason, self.message, self.bodies = reason, message, bodies


_libc = ctypes.CDLL(None)
PR_SET_PDEATHSIG = 1


def end_with_parent():
    """Called in a new process: it ends when the process that has started it does, however that one ends."""
    _libc.prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def find(name):
    path = shutil.which(name)
    if path is None:
        raise Fault("CARILLON_MISSING", f"the program {name} is not found: install the packages carillon, carillond "
                                        "and carillon-precompute, or start Blender with their folder in PATH")
    return path


@contextlib.contextmanager
def daemon():
    """The words for `carillon` that name a daemon: none where the user's daemon answers, else those of one that is
    started now, keeps its models in the user's folder, and is ended with the context."""
    carillon = find("carillon")
    if subprocess.run([carillon, "material"], capture_output=True).returncode == 0:
        yield []
        return
    if os.environ.get("CARILLON_SERVER"):
        raise Fault("SERVER_UNAVAILABLE", f"no carillond answers at {os.environ['CARILLON_SERVER']}, which "
                                          "CARILLON_SERVER names: start it there, or unset the variable")
    with tempfile.TemporaryDirectory(prefix="carillon-") as folder:
        server = f"unix:{folder}/socket"
        with open(f"{folder}/log", "w+", encoding="utf-8") as log:
            process = subprocess.Popen([find("carillond"), "--listen", server, "--audio-device", "null",
                                        "--no-transfers"], stdout=subprocess.PIPE, stderr=log, text=True,
                                       preexec_fn=end_with_parent)
            try:
                if not process.stdout.readline().startswith("listening on "):
                    log.seek(0)
                    raise Fault("DAEMON_NOT_STARTED", "carillond does not start: " + log.read().strip()[-500:])
                yield ["--server", server]
            finally:
                process.terminate()
                process.wait()
                process.stdout.close()


_materials = []
_reader = None


def read_materials(server):
    """Asks a daemon for the names of all materials."""
    done = subprocess.run([find("carillon"), *server, "material"], capture_output=True, text=True)
    _materials[:] = [line.split()[0] for line in done.stdout.splitlines() if line.strip()]


def _start_reading():
    with contextlib.suppress(Fault), daemon() as server:
        read_materials(server)


def materials():
    """The names of all materials; none until a thread, which the first call starts, has asked the daemon."""
    global _reader
    if _reader is None and not _materials:
        _reader = threading.Thread(target=_start_reading, daemon=True)
        _reader.start()
    return _materials
