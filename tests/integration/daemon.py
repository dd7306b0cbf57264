# SPDX-License-Identifier: Apache-2.0
"""The real programs for a test: a daemon in a folder of its own, and the command line."""

import contextlib
import json
import os
import pathlib
import re
import resource
import signal
import socket
import subprocess
import tempfile
import time
import unittest
import urllib.request

import grpc

import carillon
import meshes
import strike
from carillon.v1 import material_pb2, scene_service_pb2

BIN = pathlib.Path(os.environ["CARILLON_BIN_DIR"])
BUILD = pathlib.Path(os.environ.get("CARILLON_BUILD_DIR", BIN.parent))
ROOT = pathlib.Path(__file__).resolve().parents[2]
MATERIAL = material_pb2.Material(preset=meshes.MATERIAL)


def wait_until(condition, limit_s=30.0):
    """Seconds until the condition was true; fails beyond the limit."""
    begin_s = time.monotonic()
    while not condition():
        if time.monotonic() - begin_s > limit_s:
            raise AssertionError(f"not within {limit_s} s")
        time.sleep(0.01)
    return time.monotonic() - begin_s


def node_environment(folder):
    """The environment in which require('carillon') takes the checkout, and what it needs from the npm registry."""
    modules = folder / "node_modules"
    if not modules.exists():
        modules.mkdir()
        (modules / "carillon").symlink_to(ROOT / "client_sdk/node")
    return {**os.environ, "NODE_PATH": f"{modules}:{os.environ['CARILLON_NODE_MODULES']}"}


def free_port():
    with socket.socket() as bound:
        bound.bind(("127.0.0.1", 0))
        return bound.getsockname()[1]


def resident_mib(process):
    """The memory of a process (subprocess.Popen) that is resident now, MiB."""
    pages = int(pathlib.Path("/proc", str(process.pid), "statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


class Client(strike.Client):
    """The client without an SDK, and short forms of what many tests ask for."""

    def model(self, mesh=meshes.bar(), **request):
        """The name of the model of an OBJ file, once it has been computed."""
        return self.wait(self.create(mesh, "obj", **{"material": MATERIAL, **request}))

    def scene(self, model):
        """The name of a new scene, and its one object."""
        name = self.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        added = self.scenes.AddObjects(scene_service_pb2.AddObjectsRequest(
            scene=name, objects=[scene_service_pb2.NewObject(modal_model=model, material=MATERIAL)]))
        return name, added.objects[0]


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
            raise RuntimeError("carillond did not start: " + self.log())

    def log(self):
        return (self.folder / "log").read_text()

    def metrics(self):
        """The figures that Prometheus would read, by name. The last argument is their address."""
        with urllib.request.urlopen(f"http://{self.arguments[-1]}/metrics", timeout=10) as answer:
            return dict(re.findall(r"^([a-z_]+(?:\{[^}]*\})?) (\S+)$", answer.read().decode(), re.MULTILINE))

    def client(self):
        return Client(self.server)

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

    def command(self, *arguments, server=None, check=True, **options):
        """Runs `carillon`; returns what subprocess.run does, which gets the options."""
        options = {"capture_output": True, "text": True, **options}
        return subprocess.run([BIN / "carillon", "--server", server or self.server, *map(str, arguments)], check=check,
                              **options)

    def json(self, *arguments):
        """What `carillon` prints for programs."""
        return json.loads(self.command("--json", *arguments).stdout)

    def refusal(self, *arguments):
        """The reason for which `carillon` does nothing."""
        done = self.command(*arguments, check=False)
        assert (done.returncode, done.stdout) == (1, ""), done
        return re.search("(?m)^carillon: ([A-Z_]+): ", done.stderr)[1]


class RefusalsTest(unittest.TestCase):
    @contextlib.contextmanager
    def assert_refused(self, reason, words=""):
        """The block must end with a CarillonError that has this reason, and the words in its message."""
        with self.assertRaises(carillon.CarillonError) as refused:
            yield refused
        self.assertEqual(refused.exception.reason, reason)
        self.assertIn(words, refused.exception.message)


class ScratchTest(RefusalsTest):
    """Each test has a folder of its own, and serves a daemon there with the arguments that it needs."""

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="carillon-")))

    def serve(self, *arguments, **options):
        self.daemon = Daemon(self.folder, *arguments, **options)
        self.addCleanup(self.daemon.stop)
        self.client = self.daemon.client()


class DaemonTest(RefusalsTest):
    """Tests of one class share a daemon, which must end well. `client` and `c`, of the Python package, talk to it."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="carillon-")))
        cls.daemon = Daemon(cls.folder)
        cls.addClassCleanup(cls.stop_daemon)
        cls.client = cls.daemon.client()
        cls.c = cls.enterClassContext(carillon.connect(cls.daemon.server))

    @classmethod
    def stop_daemon(cls):
        status = cls.daemon.stop()
        if status != 0:
            raise AssertionError(f"carillond ended with {status}: {cls.daemon.log()}")
