# SPDX-License-Identifier: Apache-2.0
"""Signals: a stop ends within five seconds whatever the clients do, and fades; other signals do not end the daemon."""

import fcntl
import pathlib
import signal
import subprocess
import threading
import time
import unittest

import numpy

import torture
from carillon.v1 import audio_service_pb2, contact_service_pb2
from daemon import BIN, wait_until
from test_log import namespaces_permitted
from torture import STOP_S

FADE_S = 0.05
RATE = 48000


class StopTest(torture.ServedTest):
    def test_a_stop_with_open_streams_ends_in_time(self):
        for _ in range(torture.rounds(1, 20)):
            self.serve()
            waiting = threading.Event()
            self.addCleanup(waiting.set)

            def silent(first, waiting=waiting):
                yield first
                waiting.wait()  # the client neither sends nor ends

            start = contact_service_pb2.ContactStreamStart(scene="scenes/1", step_s=0.1)
            settings = audio_service_pb2.RenderSettings(sample_rate_hz=RATE)
            scene = torture.SoundingScene(self.daemon)
            calls = [self.client.audio.Listen(audio_service_pb2.ListenRequest()) for _ in range(8)]
            for _ in range(4):
                calls.append(self.client.audio.Render(silent(audio_service_pb2.RenderRequest(settings=settings))))
                calls.append(self.client.contacts.StreamContacts(silent(
                    contact_service_pb2.StreamContactsRequest(start=start))))
            next(calls[0])
            self.stop_in_time()
            waiting.set()
            scene.stop()

    def test_a_stop_fades_out(self):
        self.serve("--audio-device", f"file:{self.folder}/sound.wav")
        scene = torture.SoundingScene(self.daemon)
        time.sleep(2)
        self.stop_in_time()
        scene.stop()
        data = (self.folder / "sound.wav").read_bytes()
        samples = numpy.frombuffer(data[data.index(b"data", 12) + 8:], numpy.float32)
        end = int(numpy.flatnonzero(samples)[-1]) + 1
        self.assertLess(end, len(samples))  # silence follows
        fade = int(FADE_S * RATE)
        loudest = [numpy.abs(samples[end - fade + i:end - fade + i + fade // 10]).max()
                   for i in range(0, fade, fade // 10)]
        before = numpy.abs(samples[end - 10 * fade:end - fade]).max()
        print(f"before {before:.3g}, during the fade", [f"{peak:.3g}" for peak in loudest], flush=True)
        self.assertLess(loudest[-1], 0.05 * before)
        self.assertLess(loudest[-2], 0.15 * before)

    def test_other_signals_do_not_end_it(self):
        self.serve()
        for number in (signal.SIGUSR1, signal.SIGUSR2, signal.SIGALRM, signal.SIGHUP):
            self.daemon.process.send_signal(number)
        wait_until(lambda: "were read again" in self.daemon.log())
        self.assertEqual(self.daemon.command("status").returncode, 0)
        self.stop_in_time()

    def test_each_signal_to_stop_fades_and_ends_well(self):
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGQUIT):
            with self.subTest(number=number):
                self.serve()
                self.daemon.process.send_signal(number)
                self.assertEqual(self.daemon.process.wait(STOP_S), 0)
                self.assertIn(f"stopping on {number.name}\n", self.daemon.log())

    @unittest.skipUnless(namespaces_permitted(), "mount namespaces are not permitted here")
    def test_it_serves_without_proc(self):
        without_proc = "mount -t tmpfs none /proc && exec \"$@\""
        self.serve("--precompute", BIN / "carillon-precompute",
                   prefix=("unshare", "--mount", "--map-root-user", "sh", "-c", without_proc, "sh"))
        self.assertEqual(self.daemon.command("status").returncode, 0)
        self.stop_in_time()

    def test_a_storm_of_sighup_reads_the_configuration_once_a_second(self):
        self.serve()
        begin_s = time.monotonic()
        for _ in range(1000):
            self.daemon.process.send_signal(signal.SIGHUP)
            time.sleep(0.001)
        stormed_s = time.monotonic() - begin_s
        self.stop_in_time()
        count = self.daemon.log().count("were read again")
        self.assertGreater(count, 0)
        self.assertLessEqual(count, stormed_s + 2)

    def test_a_stop_ends_a_start_that_waits(self):
        data = self.folder / "data"
        data.mkdir(mode=0o700)
        with open(data / "lock", "w", encoding="utf-8") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)  # for which a start waits a second
            process = subprocess.Popen([BIN / "carillond", "--data-dir", data, "--listen", f"unix:{self.folder}/s",
                                        "--audio-device", "null"], stderr=subprocess.PIPE, text=True)
            self.addCleanup(process.stderr.close)
            self.addCleanup(process.kill)
            wait_until(lambda: self.handles_sigterm(process), STOP_S)
            process.terminate()
            self.assertEqual(process.wait(STOP_S), 0)
            self.assertIn("before the start was complete", process.stderr.read())

    @staticmethod
    def handles_sigterm(process):
        status = pathlib.Path("/proc", str(process.pid), "status").read_text()
        handled = int(status.partition("SigCgt:")[2].split()[0], 16)
        return bool(handled >> (signal.SIGTERM - 1) & 1)

    def test_frames_missed_while_it_was_stopped_are_counted(self):
        self.serve("--audio-device", f"file:{self.folder}/sound.wav")
        before = self.daemon.json("status")["lost_frame_count"]
        self.daemon.process.send_signal(signal.SIGSTOP)
        time.sleep(0.5)
        self.daemon.process.send_signal(signal.SIGCONT)
        wait_until(lambda: self.daemon.json("status")["lost_frame_count"] - before > 0.4 * RATE, STOP_S)
        self.stop_in_time()
