# SPDX-License-Identifier: Apache-2.0
"""A JACK server without a sound card for a test, and a daemon that plays through it."""

import json
import os
import pathlib
import shutil
import subprocess
import unittest

import meshes
from carillon.v1 import material_pb2
from daemon import BIN, Daemon

PROGRAMS = pathlib.Path(os.environ.get("CARILLON_TEST_PROGRAMS", BIN.parent / "tests"))
# ALSA may have a device "jack" too, so this is the full name.
DEVICE = "portaudio:JACK Audio Connection Kit"
PORT = "PortAudio:out_0"
PERIOD_FRAMES = 128
RATE = 48000


class Jack:
    """A server that nobody else uses: in real time, but without hardware. Its programs run with `environment`; what
    it says goes to the file `log`."""

    def __init__(self, period_frames=PERIOD_FRAMES, log=os.devnull):
        if shutil.which("jackd") is None:
            raise AssertionError("jackd is not installed: deploy/setup.sh tests")
        self.environment = dict(os.environ, JACK_DEFAULT_SERVER=f"carillon-test-{os.getpid()}",
                                JACK_NO_AUDIO_RESERVATION="1", JACK_NO_START_SERVER="1")
        with open(log, "wb") as output:
            self.process = subprocess.Popen(
                ["jackd", "-R", "-P", "50", "-d", "dummy", "-r", str(RATE), "-p", str(period_frames)],
                env=self.environment, stdout=output, stderr=subprocess.STDOUT)
        waited = subprocess.run(["jack_wait", "-w", "-t", "10"], env=self.environment, check=False,
                                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        if waited.returncode != 0:
            self.stop()
            raise unittest.SkipTest("jackd cannot run here: no shared memory, or no real-time priority")

    def stop(self):
        self.process.terminate()
        self.process.wait()


class LatencyMeasurement:
    """A JACK server, and a daemon with a bar to strike, in `folder`."""

    WAYS = ("stream", "ahead", "arrival")

    def __init__(self, folder, *arguments, period_frames=PERIOD_FRAMES):
        self.jack = Jack(period_frames)
        self.daemon = Daemon(pathlib.Path(folder), "--audio-device", DEVICE, *arguments,
                             environment=self.jack.environment)
        client = self.daemon.client()
        self.model = client.wait(client.create(
            meshes.bar(), "obj", material=material_pb2.Material(preset=meshes.MATERIAL)))

    def stop(self):
        self.daemon.stop()
        self.jack.stop()

    def measure(self, way, streams, strikes):
        """So many streams one after the other, and strikes in each: what strike_latency prints."""
        run = subprocess.run(
            [PROGRAMS / "strike_latency", self.daemon.server, self.model, PORT, way, str(streams), str(strikes)],
            env=self.jack.environment, check=True, stdout=subprocess.PIPE, text=True)
        found = json.loads(run.stdout)
        found["stated_ms"] = found["delay_ms"] + found["output_ms"] - found["beyond_capture_ms"]
        return found
