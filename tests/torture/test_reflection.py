# SPDX-License-Identifier: Apache-2.0
"""A client that opens many calls of the reflection service holds no threads of the daemon."""

import pathlib
import threading
import unittest

import grpc

import torture

METHODS = [f"/grpc.reflection.{version}.ServerReflection/ServerReflectionInfo" for version in ("v1", "v1alpha")]
CALLS, CONNECTIONS = 400, 4
# gRPC begins a few threads under any load.
MOST_THREADS = 50
# A ServerReflectionRequest for the file that contains the symbol (field 4) "carillon".
REQUEST = b"\x22\x08carillon"


class ReflectionTest(torture.ServedTest):
    def setUp(self):
        super().setUp()
        self.serve()

    def open(self, method):
        """A channel with a connection of its own, and the stream of a method on it."""
        channel = grpc.insecure_channel(self.daemon.server, [("grpc.use_local_subchannel_pool", 1)])
        self.addCleanup(channel.close)
        return channel.stream_stream(method)

    def threads(self):
        return len(list(pathlib.Path("/proc", str(self.daemon.process.pid), "task").iterdir()))

    def test_open_calls_hold_no_threads(self):
        stopped = threading.Event()
        self.addCleanup(stopped.set)

        def one_request():
            yield REQUEST
            stopped.wait()

        before = self.threads()
        for method in METHODS:
            streams = [self.open(method) for _ in range(CONNECTIONS)]
            calls = [streams[i % CONNECTIONS](one_request(), timeout=600) for i in range(CALLS)]
            for call in calls:
                next(call)
            print(f"{method}: {CALLS} open calls, {self.threads() - before} threads more", flush=True)
            self.assertLess(self.threads() - before, MOST_THREADS)
            for call in calls:
                call.cancel()


if __name__ == "__main__":
    unittest.main()
