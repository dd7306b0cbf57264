# SPDX-License-Identifier: Apache-2.0
"""What the daemon counts as lost is what a JACK capture misses: cycles in which its process for sound was stopped."""

import json
import os
import pathlib
import signal
import subprocess
import time

import jack
from carillon.v1 import audio_service_pb2
from daemon import ScratchTest, wait_until

PERIOD_FRAMES = 512  # four of the daemon's blocks
STOPS_S = (0.03, 0.06)


class LostFramesTest(ScratchTest):
    def setUp(self):
        super().setUp()
        self.addCleanup(jack.Jack(PERIOD_FRAMES, self.folder / "jackd").stop)
        self.serve("--audio-device", jack.DEVICE, environment=jack.ENVIRONMENT)

    def mixer(self):
        return self.client.audio.GetMixer(audio_service_pb2.GetMixerRequest())

    def record(self):
        recorder = subprocess.Popen(
            [jack.PROGRAMS / "record_jack", jack.PORT, "60", self.folder / "capture"], env=jack.ENVIRONMENT,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.assertEqual(recorder.stdout.readline(), "recording\n")
        return recorder

    def sound_process(self):
        """carillon-audio, which the daemon has started."""
        daemon = self.daemon.process.pid
        return int(pathlib.Path(f"/proc/{daemon}/task/{daemon}/children").read_text().split()[0])

    def let_pass(self, seconds):
        """Of the sound."""
        end = self.mixer().frame_count + seconds * jack.RATE
        wait_until(lambda: self.mixer().frame_count >= end)

    def test_frames_lost_are_those_a_capture_misses(self):
        recorder = self.record()
        self.let_pass(1.2)  # what the capture's arrival cost is known
        before = self.mixer()
        for stop_s in STOPS_S:
            os.kill(self.sound_process(), signal.SIGSTOP)
            time.sleep(stop_s)
            os.kill(self.sound_process(), signal.SIGCONT)
            self.let_pass(1.2)
        after = self.mixer()
        printed, _ = recorder.communicate()  # which ends its standard input
        captured = json.loads(printed)
        xruns = after.xrun_count - before.xrun_count
        lost = after.lost_frame_count - before.lost_frame_count
        print(captured, f"xruns {xruns}, lost frames {lost}", flush=True)
        self.assertGreaterEqual(xruns, len(STOPS_S))
        self.assertLessEqual(xruns, captured["told_xruns"])
        if "JackTimedDriver::Process XRun" in (self.folder / "jackd").read_text():
            self.skipTest("too busy for sound here: JACK itself was late, and has set its frames anew")
        self.assertGreaterEqual(lost, sum(STOPS_S) * jack.RATE - 4 * PERIOD_FRAMES)
        # On a busy machine the capture, which waits for the daemon, may miss one cycle more each time.
        self.assertEqual(lost % PERIOD_FRAMES, 0)
        self.assertLessEqual(lost, captured["missed_frames"])
        self.assertGreaterEqual(lost, captured["missed_frames"] - len(STOPS_S) * PERIOD_FRAMES)
