# SPDX-License-Identifier: Apache-2.0
"""HTTP/2 rapid resets: connections that begin calls and cancel them at once, and floods of pings and settings.

A good client goes on meanwhile, and the daemon's memory comes back.
"""

import contextlib
import socket
import statistics
import struct
import threading
import time
import unittest

import grpc

import torture
from carillon.v1 import audio_service_pb2
from http2_frames import CALL, CANCEL, END_HEADERS, HEADERS, METHOD, PING, PREFACE, RST_STREAM, SETTINGS, frame

CONNECTIONS = 4
RUN_S = torture.rounds(2.0, 20.0)
# The bound on a machine that does nothing else. Otherwise a test must only end.
P99_S = 0.05 if torture.LONG else 10.0
# What calls take that have begun before the daemon looks at the connection.
GROWTH_MIB = 256
LEFT_MIB = 16
# The daemon gives freed memory back every 5 s; some of it is in use until the connections have ended.
REST_S = 60

MOST_STREAM_ID = 2**31 - 1
FRAMES_AT_ONCE = 200


def resets(stream):
    """A call that is cancelled before its message."""
    return (frame(HEADERS, END_HEADERS, stream, CALL)
            + frame(RST_STREAM, 0, stream, struct.pack(">I", CANCEL)))


def unfinished(stream):
    """A call that waits for its message for ever."""
    return frame(HEADERS, END_HEADERS, stream, CALL)


def pings(_):
    return frame(PING, 0, 0, b"12345678")


def settings(_):
    return frame(SETTINGS)


class Flood:
    """Connections that send frames as fast as the daemon takes them, and read all answers, or none at all. A connection
    that the daemon closes is made again."""

    def __init__(self, path, make, reads):
        self.path = path
        self.make = make
        self.reads = reads
        self.stopped = False
        self.frames = self.connections = 0
        self.lock = threading.Lock()
        self.threads = [threading.Thread(target=self._run) for _ in range(CONNECTIONS)]
        for thread in self.threads:
            thread.start()

    def _run(self):
        while not self.stopped:
            with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
                # A timeout of Python's own would let each read wait for it.
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, struct.pack("ll", 1, 0))
                connection.connect(self.path)
                with self.lock:
                    self.connections += 1
                self._send(connection)
            time.sleep(0.01)

    def _send(self, connection):
        connection.sendall(PREFACE + frame(SETTINGS))
        stream = 1
        while not self.stopped and stream < MOST_STREAM_ID - 2 * FRAMES_AT_ONCE:
            connection.sendall(b"".join(self.make(stream + 2 * i) for i in range(FRAMES_AT_ONCE)))
            stream += 2 * FRAMES_AT_ONCE
            with self.lock:
                self.frames += FRAMES_AT_ONCE
            with contextlib.suppress(BlockingIOError):
                while self.reads and connection.recv(1 << 16, socket.MSG_DONTWAIT):
                    pass

    def stop(self):
        self.stopped = True
        for thread in self.threads:
            thread.join()


class RapidResetTest(torture.ServedTest):
    def setUp(self):
        super().setUp()
        self.serve()
        channel = grpc.insecure_channel(self.daemon.server, [("grpc.use_local_subchannel_pool", 1)])
        self.addCleanup(channel.close)
        self.call = channel.unary_unary(METHOD.decode(), audio_service_pb2.GetMixerRequest.SerializeToString,
                                        audio_service_pb2.GetMixerResponse.FromString)

    def attack(self, make, reads=True):
        quiet, _ = self.calls(self.call, 1.0)
        before_mib = torture.resident_mib(self.daemon.process)
        flood = Flood(str(self.folder / "socket"), make, reads)
        try:
            amid, most_mib = self.calls(self.call, RUN_S)
        finally:
            flood.stop()
        rest_s = torture.wait_until(lambda: torture.resident_mib(self.daemon.process) < before_mib + LEFT_MIB, REST_S)
        p99_s = statistics.quantiles(amid, n=100)[98]
        print(f"{make.__name__}: {flood.frames} in {RUN_S:g} s on {CONNECTIONS} connections, made {flood.connections} "
              f"times; a good call took {1e3 * statistics.median(quiet):.1f} ms before, amid them "
              f"{1e3 * statistics.median(amid):.1f}, p99 {1e3 * p99_s:.1f} ms; {before_mib:.1f} MiB before, at most "
              f"{most_mib:.1f}, {torture.resident_mib(self.daemon.process):.1f} {rest_s:.0f} s after", flush=True)
        self.assertGreater(flood.frames, 0)
        self.assertLess(p99_s, P99_S)
        self.assertLess(most_mib, before_mib + GROWTH_MIB)
        self.assertLess(torture.resident_mib(self.daemon.process), before_mib + LEFT_MIB)

    def test_calls_that_are_cancelled_at_once(self):
        self.attack(resets)

    def test_calls_that_never_send_their_message(self):
        self.attack(unfinished)

    def test_pings(self):
        self.attack(pings)

    def test_pings_whose_answers_nobody_reads(self):
        self.attack(pings, reads=False)

    def test_settings(self):
        self.attack(settings)


if __name__ == "__main__":
    unittest.main()
