# SPDX-License-Identifier: Apache-2.0
"""The real programs for a test: a daemon in a folder of its own, and the command line."""

import os
import pathlib
import signal
import subprocess
import tempfile
import unittest

import grpc

import strike

BIN = pathlib.Path(os.environ["CARILLON_BIN_DIR"])
ROOT = pathlib.Path(__file__).resolve().parents[2]


class Daemon:
    """carillond on a Unix socket within `folder`, without a sound device and without transfers, which would change
    the levels of what sounds, unless `arguments` ask for them."""

    def __init__(self, folder, *arguments, environment=None, prefix=()):
        self.environment = environment
        self.prefix = prefix
        self.folder = pathlib.Path(folder)
        self.arguments = [str(argument) for argument in arguments]
        self.server = f"unix:{self.folder}/socket"
        self.process = None
        self.start()

    def start(self):
        """Returns once it listens."""
        with open(self.folder / "log", "ab") as log:
            self.process = subprocess.Popen(
                [*self.prefix, BIN / "carillond", "--data-dir", self.folder / "data", "--listen", self.server,
                 *([] if "--audio-device" in self.arguments else ["--audio-device", "null"]),
                 *([] if "--transfers" in self.arguments else ["--no-transfers"]), *self.arguments],
                stdout=subprocess.PIPE, stderr=log, text=True, env=self.environment)
        address_count = 1 + self.arguments.count("--listen")
        self.listening = [self.process.stdout.readline() for _ in range(address_count)]
        if not self.listening[-1].startswith("listening on "):
            raise RuntimeError("carillond did not start: " + (self.folder / "log").read_text())

    def client(self):
        return strike.Client(self.server)

    def health(self, service=""):
        """Of the whole server, or of one service: "SERVING" or "NOT_SERVING", as grpc.health.v1 says."""
        check = grpc.insecure_channel(self.server).unary_unary("/grpc.health.v1.Health/Check")
        with_field = bytes([10, len(service)]) + service.encode() if service else b""
        return ("UNKNOWN", "SERVING", "NOT_SERVING")[check(with_field)[1]]

    def kill(self):
        """As when the power fails, for this process."""
        self._end(signal.SIGKILL)

    def stop(self):
        self._end(signal.SIGTERM)
        return self.process.returncode

    def _end(self, number):
        if self.process.poll() is None:
            self.process.send_signal(number)
        self.process.wait()
        self.process.stdout.close()

    def command(self, *arguments, check=True):
        """Runs `carillon`; returns what subprocess.run does."""
        return subprocess.run([BIN / "carillon", "--server", self.server, *map(str, arguments)],
                              capture_output=True, text=True, check=check)


class DaemonTest(unittest.TestCase):
    """Tests of one class share a daemon, which must end well."""

    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        cls.addClassCleanup(scratch.cleanup)
        cls.folder = pathlib.Path(scratch.name)
        cls.daemon = Daemon(cls.folder)
        cls.addClassCleanup(cls.stop_daemon)
        cls.client = cls.daemon.client()

    @classmethod
    def stop_daemon(cls):
        status = cls.daemon.stop()
        if status != 0:
            raise AssertionError(f"carillond ended with {status}: "
                                 + (cls.folder / "log").read_text())
