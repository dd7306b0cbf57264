# SPDX-License-Identifier: Apache-2.0
"""Signals: a stop ends within five seconds whatever the clients do, and fades; other signals do not end the daemon."""

import fcntl
import hashlib
import pathlib
import signal
import subprocess
import threading
import time
import unittest

import grpc
import numpy

import torture
from carillon.v1 import admin_service_pb2, admin_service_pb2_grpc, audio_service_pb2, contact_service_pb2
from daemon import BIN, Daemon
from test_log import namespaces_permitted

STOP_S = 5.0 if torture.LONG else 30.0
FADE_S = 0.05
RATE = 48000


def read_float_wave(path):
    data = pathlib.Path(path).read_bytes()
    return numpy.frombuffer(data[data.index(b"data", 12) + 8:], numpy.float32)


class StopTest(torture.ServedTest):
    def stop_in_time(self):
        begin_s = time.monotonic()
        self.assertEqual(self.daemon.stop(), 0)
        taken_s = time.monotonic() - begin_s
        print(f"stopped within {taken_s:.2f} s", flush=True)
        self.assertLess(taken_s, STOP_S)

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
        samples = read_float_wave(self.folder / "sound.wav")
        end = int(numpy.flatnonzero(samples)[-1]) + 1
        self.assertLess(end, len(samples))  # silence follows
        fade = int(FADE_S * RATE)
        loudest = [numpy.abs(samples[end - fade + i:end - fade + i + fade // 10]).max()
                   for i in range(0, fade, fade // 10)]
        before = numpy.abs(samples[end - 10 * fade:end - fade]).max()
        print(f"before {before:.3g}, during the fade", [f"{peak:.3g}" for peak in loudest], flush=True)
        self.assertLess(loudest[-1], 0.05 * before)
        self.assertLess(loudest[-2], 0.15 * before)

    def test_other_signals_do_not_end_it_and_sighup_reads_the_token_again(self):
        access = self.folder / "access"
        access.touch(0o600)

        def write(token):
            access.write_text(f"keeper administer sha256:{hashlib.sha256(token.encode()).hexdigest()}\n")
        write("the first of two tokens")
        configuration = self.folder / "carillond.toml"
        configuration.write_text(f'access_file = "{access}"\n')
        self.serve("--config", configuration, "--listen", "127.0.0.1:0")
        address = self.daemon.listening[1].split()[-1]
        for number in (signal.SIGUSR1, signal.SIGUSR2, signal.SIGALRM, signal.SIGHUP):
            self.daemon.process.send_signal(number)
        self.assertEqual(self.is_admitted(address, "the first of two tokens"), True)
        write("the second of two tokens")
        self.daemon.process.send_signal(signal.SIGHUP)
        torture.wait_until(lambda: self.is_admitted(address, "the second of two tokens"), 30.0)
        self.assertEqual(self.is_admitted(address, "the first of two tokens"), False)
        configuration.write_text("access_file = 7\n")
        self.daemon.process.send_signal(signal.SIGHUP)
        torture.wait_until(lambda: "nothing was changed" in (self.folder / "log").read_text(), 30.0)
        self.assertEqual(self.is_admitted(address, "the second of two tokens"), True)
        self.stop_in_time()

    def test_each_signal_to_stop_fades_and_ends_well(self):
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGQUIT):
            with self.subTest(number=number):
                self.serve()
                self.daemon.process.send_signal(number)
                self.assertEqual(self.daemon.process.wait(STOP_S), 0)
                self.assertIn(f"stopping on {number.name}\n", (self.folder / "log").read_text())

    @unittest.skipUnless(namespaces_permitted(), "mount namespaces are not permitted here")
    def test_it_serves_without_proc(self):
        without_proc = "mount -t tmpfs none /proc && exec \"$@\""
        self.daemon = Daemon(self.folder, "--precompute", BIN / "carillon-precompute",
                             prefix=("unshare", "--mount", "--map-root-user", "sh", "-c", without_proc, "sh"))
        self.addCleanup(self.daemon.kill)
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
        count = (self.folder / "log").read_text().count("were read again")
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
            torture.wait_until(lambda: self.blocks_sigterm(process), STOP_S)
            process.terminate()
            self.assertEqual(process.wait(STOP_S), 0)
            self.assertIn("before the start was complete", process.stderr.read())

    @staticmethod
    def blocks_sigterm(process):
        status = pathlib.Path("/proc", str(process.pid), "status").read_text()
        blocked = int(status.partition("SigBlk:")[2].split()[0], 16)
        return bool(blocked >> (signal.SIGTERM - 1) & 1)

    def test_frames_missed_while_it_was_stopped_are_counted(self):
        self.serve("--audio-device", f"file:{self.folder}/sound.wav")
        before = self.client.audio.GetMixer(audio_service_pb2.GetMixerRequest())
        self.daemon.process.send_signal(signal.SIGSTOP)
        time.sleep(0.5)
        self.daemon.process.send_signal(signal.SIGCONT)

        def lost():
            after = self.client.audio.GetMixer(audio_service_pb2.GetMixerRequest())
            return after.lost_frame_count - before.lost_frame_count
        torture.wait_until(lambda: lost() > 0.4 * RATE, STOP_S)
        self.stop_in_time()

    @staticmethod
    def is_admitted(address, token):
        admin = admin_service_pb2_grpc.AdminServiceStub(grpc.insecure_channel(address))
        try:
            admin.GetDatabaseStats(admin_service_pb2.GetDatabaseStatsRequest(),
                                   metadata=(("authorization", f"Bearer {token}"),))
        except grpc.RpcError:
            return False
        return True


if __name__ == "__main__":
    unittest.main()
