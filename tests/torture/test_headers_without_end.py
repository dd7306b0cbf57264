# SPDX-License-Identifier: Apache-2.0
"""A client without credentials that begins a call whose headers never end. gRPC 1.51 keeps them all."""

import contextlib
import socket
import unittest

import torture
from http2_frames import CONTINUATION, HEADERS, PREFACE, SETTINGS, field, frame

VALUE_BYTES = 7000
MOST_BYTES = torture.rounds(256, 1024) << 20
# The daemon allows 18 MiB; some are on their way meanwhile, in the buffers of the kernel.
CLOSED_BYTES, MOST_MIB = 160 << 20, 100


class HeadersWithoutEndTest(torture.ServedTest):
    def test_the_connection_is_closed(self):
        self.serve("--listen", "127.0.0.1:0")
        scene = torture.SoundingScene(self.daemon)
        self.addCleanup(scene.stop)
        torture.wait_until(lambda: scene.answer.accepted_count > 0, 30)
        before = torture.resident_mib(self.daemon.process)
        port = int(self.daemon.listening[-1].rpartition(":")[2])
        more = frame(CONTINUATION, 0, 1, field(b"x-more", bytes(VALUE_BYTES)))
        sent, most_mib = 0, 0.0
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)) as connection:
            connection.sendall(PREFACE + frame(SETTINGS) + frame(HEADERS, 0, 1, field(b":method", b"POST")))
            while sent < MOST_BYTES:
                connection.sendall(more * 16)
                sent += 16 * len(more)
                most_mib = max(most_mib, torture.resident_mib(self.daemon.process) - before)
        print(f"closed after {sent >> 20} MiB, at most {most_mib:.0f} MiB more", flush=True)
        self.assertLess(sent, CLOSED_BYTES)
        self.assertLess(most_mib, MOST_MIB)
        torture.wait_until(lambda: "neither calls nor whole messages" in (self.folder / "log").read_text(), 10)
        begun = scene.answer.accepted_count
        torture.wait_until(lambda: scene.answer.accepted_count > begun, 10)


if __name__ == "__main__":
    unittest.main()
