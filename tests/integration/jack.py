# SPDX-License-Identifier: Apache-2.0
"""A JACK server without a sound card for a test, and a daemon that plays through it."""

import collections
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import numpy

import carillon
import meshes
from daemon import BIN, Daemon

PROGRAMS = pathlib.Path(os.environ.get("CARILLON_TEST_PROGRAMS", BIN.parent / "tests"))
# ALSA may have a device "jack" too, so this is the full name.
DEVICE = "portaudio:JACK Audio Connection Kit"
PORT = "PortAudio:out_0"
PERIOD_FRAMES = 128
RATE = 48000
# Of the programs that use the server of this test, which nobody else does.
ENVIRONMENT = dict(os.environ, JACK_DEFAULT_SERVER=f"carillon-test-{os.getpid()}", JACK_NO_AUDIO_RESERVATION="1",
                   JACK_NO_START_SERVER="1")


def command(rate=RATE, period_frames=PERIOD_FRAMES):
    """A server in real time, but without hardware."""
    return ["jackd", "-R", "-P", "50", "-d", "dummy", "-r", str(rate), "-p", str(period_frames)]


def is_ready():
    return subprocess.run(["jack_wait", "-w", "-t", "10"], env=ENVIRONMENT, check=False, stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL).returncode == 0


class Jack:
    """What the server says goes to the file `log`."""

    def __init__(self, period_frames=PERIOD_FRAMES, log=os.devnull):
        if shutil.which("jackd") is None:
            raise AssertionError("jackd is not installed: deploy/setup.sh tests")
        with open(log, "wb") as output:
            self.process = subprocess.Popen(command(period_frames=period_frames), env=ENVIRONMENT, stdout=output,
                                            stderr=subprocess.STDOUT)
        if not is_ready():
            self.stop()
            raise unittest.SkipTest("jackd cannot run here: no shared memory, or no real-time priority")

    def stop(self):
        self.process.terminate()
        self.process.wait()


class LatencyMeasurement:
    """A JACK server, and a daemon with a bar to strike, in `folder`."""

    def __init__(self, folder, period_frames):
        self.jack = Jack(period_frames)
        self.daemon = Daemon(pathlib.Path(folder), "--audio-device", DEVICE, environment=ENVIRONMENT)
        self.c = carillon.connect(self.daemon.server)
        self.model = self.c.create_model(meshes.box(meshes.BAR_SIZE), meshes.MATERIAL)

    def stop(self):
        self.c.close()
        self.daemon.stop()
        self.jack.stop()

    def measure(self, way, streams, strikes):
        """So many streams one after the other, and strikes in each: what `latencies` finds."""
        with self.c.scene() as scene, tempfile.NamedTemporaryFile() as capture:
            bar = scene.add(self.model, DULL)
            before = self.c.status()
            most_s = streams * (2 + LONGEST_GAP_S * (strikes + 1)) + 1
            run = subprocess.run([PROGRAMS / "record_jack", PORT, str(most_s), capture.name, self.daemon.server,
                                  scene.name, str(bar.handle), way, str(streams), str(strikes)], env=ENVIRONMENT,
                                 check=True, stdout=subprocess.PIPE)
            after = self.c.status()
            told = json.loads(run.stdout.splitlines()[-1])
            told["output_s"], told["xruns"] = after.output_latency_s, after.xrun_count - before.xrun_count
            return latencies(told, numpy.fromfile(capture.name, numpy.float32))


# Damping that lets every mode die within 10 ms, down to the frame where the bank falls asleep and all samples are zero:
# so each strike's first sample is the first that is not.
DULL = carillon.material(meshes.MATERIAL, alpha2_per_s=4000)
# All of these must be zero before the first sample of a strike.
QUIET_FRAMES = 48
# Of strikes, as jack_capture.cc has them.
SHORTEST_GAP_S, LONGEST_GAP_S = 0.014, 0.030
# Strikes that ran together are one onset.
REACH = 16


def latencies(told, samples):
    """How long each strike took from the client to its first sample, by what record_jack tells and captured. A
    strike is in place if it is heard to the sample where the daemon says, displaced if it is heard later, and unheard
    if it ran together with the next."""
    rate, streams = told["sample_rate_hz"], told["streams"]
    sounding = numpy.flatnonzero(samples)
    onsets = sounding[numpy.diff(sounding, prepend=-QUIET_FRAMES - 1) > QUIET_FRAMES]
    stamps = [numpy.array(stream["stamps_s"]) for stream in streams]
    # Where in the mixer's frames a strike is first heard: the sine begins at zero.
    mixer = numpy.concatenate([numpy.floor(stream["first_frame"] + (stamp + stream["scheduling_delay_s"]) * rate) + 1
                               for stream, stamp in zip(streams, stamps)])
    sent_s = numpy.concatenate([stream["first_s"] + stamp for stream, stamp in zip(streams, stamps)])
    arrival_s = numpy.concatenate([numpy.full(len(stamp), stream["arrived_s"] - stream["first_s"])
                                   for stream, stamp in zip(streams, stamps)])
    # From the mixer's frames to the capture's: what most strikes agree on.
    votes = collections.Counter(onset - frame for i, frame in enumerate(mixer)
                                for onset in onsets[max(0, i - REACH):i + 1])
    due = mixer + (votes.most_common(1)[0][0] if votes else 0)
    heard = numpy.append(onsets, numpy.inf)[numpy.searchsorted(onsets, due)]
    is_heard = heard < numpy.append(due[1:], numpy.inf)
    in_place = heard[is_heard] == due[is_heard]
    first_frames, begins_s = numpy.array(told["cycles"]).T
    cycles = numpy.searchsorted(first_frames, heard[is_heard], side="right") - 1
    latency_s = begins_s[cycles] + (heard[is_heard] - first_frames[cycles]) / rate - sent_s[is_heard]
    delay_s, stated_output_s = streams[0]["scheduling_delay_s"], told["output_s"] - told["beyond_capture_s"]
    over_s = latency_s - delay_s - stated_output_s - arrival_s[is_heard]
    # A server that stood still and caught up has missed no cycle, but told wrong times meanwhile.
    clock_error_s = numpy.ptp(begins_s - first_frames / rate)
    shares = {"least": 0, "p50": 0.5, "most": 1}
    in_ms = {"delay": delay_s, "output": told["output_s"], "stated": delay_s + stated_output_s,
             "shortest_gap": SHORTEST_GAP_S, "clock_error": clock_error_s,
             "most_over": over_s[in_place].max(initial=-1),
             **{name: numpy.quantile(latency_s, share, method="higher") if len(latency_s) else 0
                for name, share in shares.items()}}
    return {"strikes": len(due), "late": sum(stream["late"] for stream in streams), "in_place": int(in_place.sum()),
            "displaced": int((~in_place).sum()), "unheard": int((~is_heard).sum()), "xruns": told["xruns"],
            "missed_cycles": told["missed_cycles"], **{f"{name}_ms": 1e3 * value for name, value in in_ms.items()}}
