# SPDX-License-Identifier: Apache-2.0
"""A client without credentials that begins many calls, and sends all but one byte of the message of each.

gRPC keeps these messages and, when its memory is used up, ends calls of the same server. A simulator that strikes over
the Unix socket meanwhile must not lose its stream.
"""

import contextlib
import socket
import threading
import time
import unittest

import h2.config
import h2.connection
import h2.events
import h2.exceptions
import torture

CALLS = 200
MESSAGE_BYTES = 2 << 20
PIECE_BYTES = 1 << 14
RUN_S = torture.rounds(4.0, 30.0)
# What gRPC may keep for one address, and the daemon's other needs.
MOST_MIB = 96 + 160
HEADERS = [(":method", "POST"), (":scheme", "http"), (":path", "/carillon.v1.AudioService/GetMixer"),
           (":authority", "localhost"), ("te", "trailers"), ("content-type", "application/grpc")]
PREFIX = b"\0" + MESSAGE_BYTES.to_bytes(4, "big")


class UnfinishedCalls:
    """A connection with CALLS open calls. Calls that the daemon ends are begun again, and so is the connection."""

    def __init__(self, port):
        self.port = port
        self.stopped = False
        self.sent_bytes = self.ended_calls = 0
        self.thread = threading.Thread(target=self._run)
        self.thread.start()

    def _run(self):
        while not self.stopped:
            # The daemon may close the connection before its settings have been read.
            with (contextlib.suppress(OSError, h2.exceptions.ProtocolError),
                  socket.create_connection(("127.0.0.1", self.port)) as connection):
                self._attack(connection)
            time.sleep(0.01)

    def _attack(self, connection):
        http = h2.connection.H2Connection(h2.config.H2Configuration(validate_outbound_headers=False))
        http.initiate_connection()
        connection.settimeout(0.01)
        left = {}
        while not self.stopped:
            while len(left) < min(CALLS, http.remote_settings.max_concurrent_streams):
                stream = http.get_next_available_stream_id()
                http.send_headers(stream, HEADERS)
                http.send_data(stream, PREFIX)
                left[stream] = MESSAGE_BYTES - 1
            for stream in list(left):
                size = min(left[stream], http.local_flow_control_window(stream), PIECE_BYTES)
                if size > 0:
                    http.send_data(stream, bytes(size))
                    left[stream] -= size
                    self.sent_bytes += size
            connection.sendall(http.data_to_send())
            with contextlib.suppress(TimeoutError):
                received = connection.recv(1 << 16)
                if not received:
                    return
                self._take(http.receive_data(received), left)

    def _take(self, events, left):
        for event in events:
            if isinstance(event, (h2.events.StreamReset, h2.events.StreamEnded)):
                self.ended_calls += left.pop(event.stream_id, None) is not None

    def stop(self):
        self.stopped = True
        self.thread.join()


class UnfinishedMessagesTest(torture.ServedTest):
    def test_a_simulator_keeps_its_stream(self):
        access = self.folder / "access"
        access.touch(0o600)
        access.write_text("console administer certificate:console\n", encoding="utf-8")
        self.serve("--listen", "127.0.0.1:0", "--access-file", str(access))
        scene = torture.SoundingScene(self.daemon)
        self.addCleanup(scene.stop)
        torture.wait_until(lambda: scene.answer.accepted_count > 0, 30)
        begun, begin_s = scene.answer.accepted_count, time.monotonic()
        attack = UnfinishedCalls(int(self.daemon.listening[-1].rpartition(":")[2]))
        most_mib = 0.0
        try:
            while time.monotonic() - begin_s < RUN_S:
                most_mib = max(most_mib, torture.resident_mib(self.daemon.process))
                time.sleep(0.05)
        finally:
            attack.stop()
        amid = scene.answer.accepted_count - begun
        print(f"{attack.sent_bytes >> 20} MiB of unfinished messages, {attack.ended_calls} calls ended; {amid} strikes "
              f"in time; at most {most_mib:.0f} MiB", flush=True)
        self.assertGreater(attack.sent_bytes, MESSAGE_BYTES * CALLS // 2)
        self.assertTrue(all(thread.is_alive() for thread in scene.threads), "the simulator's stream was ended")
        self.assertEqual(scene.answer.dropped_count, 0)
        self.assertGreater(amid, RUN_S / scene.PERIOD_S / 2)
        self.assertLess(most_mib, MOST_MIB)


if __name__ == "__main__":
    unittest.main()
