# SPDX-License-Identifier: Apache-2.0
"""A client that begins calls on ever new connections, or on many at once. The daemon refuses its process, and goes on
for the others."""

import contextlib
import multiprocessing
import socket
import time
import unittest

import torture
from carillon.v1 import audio_service_pb2
from http2_frames import CALL, END_HEADERS, HEADERS, PREFACE, SETTINGS, frame

CALLS = 250
SECONDS = torture.rounds(2, 20)
# On a quiet machine 1 s; the tests of CI share theirs.
MOST_S = torture.rounds(10, 2)
HOLDERS = 100
BYTES = PREFACE + frame(SETTINGS) + b"".join(frame(HEADERS, END_HEADERS, 1 + 2 * i, CALL) for i in range(CALLS))


def connect(path):
    connection = socket.socket(socket.AF_UNIX)
    connection.settimeout(1)
    connection.connect(path)
    connection.sendall(BYTES)
    return connection


def begin_and_leave(path, ended):
    """Connections that begin CALLS calls and are closed at once."""
    while not ended.is_set():
        with contextlib.suppress(OSError):
            connect(path).close()


def begin_and_stay(path, ended):
    """HOLDERS connections whose calls stay open."""
    held = []
    for _ in range(HOLDERS):
        with contextlib.suppress(OSError):
            held.append(connect(path))
    ended.wait()


class ReconnectsTest(torture.ServedTest):
    def attacked(self, attack):
        """The daemon's log, and the longest call of another process after the attack was noticed."""
        self.serve()
        context = multiprocessing.get_context("spawn")
        ended = context.Event()
        attacker = context.Process(target=attack, args=(str(self.folder / "socket"), ended), daemon=True)
        attacker.start()
        self.addCleanup(attacker.kill)
        log = self.folder / "log"
        noticed_s = torture.wait_until(lambda: "refuses connections of unix:pid-" in log.read_text(), 60)
        begin_s = time.monotonic()
        # The kernel may refuse a first connection, because the attacker's fill the queue.
        self.client.audio.GetMixer(audio_service_pb2.GetMixerRequest(), timeout=60, wait_for_ready=True)
        backlog_s = time.monotonic() - begin_s
        times, most_mib = self.calls(self.client.audio.GetMixer, SECONDS)
        print(f"{attack.__name__}: noticed after {noticed_s:.1f} s, a backlog of {backlog_s:.1f} s, then at most "
              f"{max(times):.2f} s a call, {most_mib:.0f} MiB", flush=True)
        ended.set()
        attacker.join()
        return log.read_text(), max(times)

    def test_calls_that_are_left_on_ever_new_connections(self):
        log, longest_s = self.attacked(begin_and_leave)
        # If gRPC is slow, the calls of the connections that wait exceed the other limit first.
        self.assertRegex(log, r"it has begun and left \d+ calls .* at most 2500 a second|it has \d+ open calls on")
        self.assertLess(longest_s, MOST_S)

    def test_calls_that_are_held_on_many_connections(self):
        log, longest_s = self.attacked(begin_and_stay)
        self.assertRegex(log, r"it has \d+ open calls on \d+ connections, and at most 4096 are allowed")
        self.assertLess(longest_s, MOST_S)


if __name__ == "__main__":
    unittest.main()
