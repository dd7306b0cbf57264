# SPDX-License-Identifier: Apache-2.0
"""Signals: a stop ends within five seconds whatever the clients do, and fades; other signals do not end the daemon."""

import hashlib
import pathlib
import signal
import threading
import time
import unittest

import grpc
import numpy

import torture
from carillon.v1 import admin_service_pb2, admin_service_pb2_grpc, audio_service_pb2, contact_service_pb2

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
        for number in (signal.SIGUSR1, signal.SIGUSR2, signal.SIGHUP):
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
