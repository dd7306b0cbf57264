# SPDX-License-Identifier: Apache-2.0
"""What the programs of this folder share. Each runs short as a test, and long by deploy/torture.sh."""

import contextlib
import os
import pathlib
import resource
import socket
import tempfile
import threading
import time
import unittest

import meshes
from carillon.v1 import audio_service_pb2, contact_pb2, contact_service_pb2, material_pb2, scene_service_pb2
from daemon import Daemon

LONG = os.environ.get("CARILLON_TORTURE") == "long"


def rounds(short, long):
    return long if LONG else short


def free_port():
    with socket.socket() as bound:
        bound.bind(("127.0.0.1", 0))
        return bound.getsockname()[1]


def wait_until(condition, limit_s):
    """Seconds until the condition was true; fails beyond the limit."""
    begin_s = time.monotonic()
    while not condition():
        if time.monotonic() - begin_s > limit_s:
            raise AssertionError(f"not within {limit_s} s")
        time.sleep(0.01)
    return time.monotonic() - begin_s


def resident_mib(process):
    """The memory of a process (subprocess.Popen) that is resident now, MiB."""
    pages = int(pathlib.Path("/proc", str(process.pid), "statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


class ScratchTest(unittest.TestCase):
    """A test with a folder of its own."""

    def setUp(self):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)


class ServedTest(ScratchTest):
    """A test that serves a daemon with the arguments that it needs."""

    def serve(self, *arguments):
        self.daemon = Daemon(self.folder, *arguments)
        self.addCleanup(self.daemon.kill)
        self.client = self.daemon.client()

    def calls(self, call, seconds):
        """The durations of `call`, a GetMixer, fifty a second at most, and the daemon's largest memory meanwhile."""
        times, most_mib = [], 0.0
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            begin_s = time.monotonic()
            call(audio_service_pb2.GetMixerRequest(), timeout=30)
            times.append(time.monotonic() - begin_s)
            most_mib = max(most_mib, resident_mib(self.daemon.process))
            time.sleep(0.02)
        return times, most_mib


class SoundingScene:
    """A bar that is struck twenty times a second, by one stream of contacts, and one listener, until `stop`."""

    PERIOD_S = 0.05

    def __init__(self, daemon):
        self.client = daemon.client()
        self.model = self.client.wait(self.client.create(
            meshes.bar(), "obj", material=material_pb2.Material(preset=meshes.MATERIAL)))
        self.scene = self.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        self.handle = self.client.scenes.AddObjects(scene_service_pb2.AddObjectsRequest(
            scene=self.scene,
            objects=[scene_service_pb2.NewObject(modal_model=self.model,
                material=material_pb2.Material(preset=meshes.MATERIAL))])).objects[0].handle
        self.stopped = threading.Event()
        self.answer = contact_service_pb2.StreamContactsResponse()
        self.heard = audio_service_pb2.ListenResponse()
        self.loudest = 0.0
        self.threads = [threading.Thread(target=self._strike), threading.Thread(target=self._listen)]
        for thread in self.threads:
            thread.start()

    def _requests(self):
        request = contact_service_pb2.StreamContactsRequest
        yield request(start=contact_service_pb2.ContactStreamStart(scene=self.scene, step_s=self.PERIOD_S))
        begin_s = time.monotonic()
        step = 0
        while not self.stopped.wait(max(0.0, begin_s + step * self.PERIOD_S - time.monotonic())):
            impulse = contact_pb2.Contact(
                kind=contact_pb2.CONTACT_KIND_IMPACT, object=self.handle,
                point_m=contact_pb2.Vec3(z=meshes.BAR_SIZE[2]),
                impulse_newton_seconds=contact_pb2.Vec3(z=-0.001))
            yield request(steps=[contact_pb2.ContactStep(time_s=step * self.PERIOD_S, contacts=[impulse])])
            step += 1

    def _strike(self):
        with contextlib.suppress(Exception):  # the daemon may stop first
            for self.answer in self.client.contacts.StreamContacts(self._requests()):
                pass

    def _listen(self):
        with contextlib.suppress(Exception):
            for self.heard in self.client.audio.Listen(audio_service_pb2.ListenRequest()):
                if self.stopped.is_set():
                    return

    def mixer(self):
        return self.client.audio.GetMixer(audio_service_pb2.GetMixerRequest())

    def stop(self):
        self.stopped.set()
        for thread in self.threads:
            thread.join()
