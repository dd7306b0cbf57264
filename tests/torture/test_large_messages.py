# SPDX-License-Identifier: Apache-2.0
"""Messages of up to a million entries without content, which take memory and time to parse.

A good client goes on meanwhile, and the daemon's memory comes back.
"""

import contextlib
import statistics
import threading
import unittest

import grpc

import torture
from carillon.v1 import audio_service_pb2, contact_pb2, contact_service_pb2, contact_trace_pb2, scene_service_pb2

CONNECTIONS = 12
MESSAGE_BYTES = torture.rounds(500_000, 2_000_000)
RUN_S = torture.rounds(3.0, 30.0)
# The bound on a machine that does nothing else. Otherwise a test must only end.
P99_S = 0.05 if torture.LONG else 10.0
# One message of each attacking client is parsed at a time, and a few wait in gRPC.
GROWTH_MIB = 512
LEFT_MIB = 32
REST_S = 60


def repeated(message, byte_count=MESSAGE_BYTES):
    """The message again and again, which protobuf reads as one message with all the entries."""
    once = message.SerializeToString()
    return once * (byte_count // len(once))


class Flood:
    """Streams that begin with `first`, then send `large` again and again. A stream that the daemon ends is made
    again."""

    def __init__(self, server, method, first, large):
        self.server = server
        self.method = method
        self.messages = (first, large)
        self.stopped = False
        self.sent = 0
        self.lock = threading.Lock()
        self.threads = [threading.Thread(target=self._run) for _ in range(CONNECTIONS)]
        for thread in self.threads:
            thread.start()

    def _requests(self):
        yield self.messages[0]
        while not self.stopped:
            yield self.messages[1]
            with self.lock:
                self.sent += 1

    def _run(self):
        with grpc.insecure_channel(self.server, [("grpc.use_local_subchannel_pool", 1)]) as channel:
            call = channel.stream_stream(self.method)
            while not self.stopped:
                with contextlib.suppress(grpc.RpcError):
                    for _ in call(self._requests(), timeout=600):
                        pass

    def stop(self):
        self.stopped = True
        for thread in self.threads:
            thread.join()


class LargeMessageTest(torture.ServedTest):
    def setUp(self):
        super().setUp()
        self.serve()

    def attack(self, method, first, attacking):
        good = self.client.audio.GetMixer
        quiet, before_mib = self.calls(good, 1.0)
        flood = Flood(self.daemon.server, method, first.SerializeToString(), attacking)
        try:
            amid, most_mib = self.calls(good, RUN_S)
        finally:
            flood.stop()
        rest_s = torture.wait_until(lambda: torture.resident_mib(self.daemon.process) < before_mib + LEFT_MIB, REST_S)
        p99_s = statistics.quantiles(amid, n=100)[98]
        print(f"{method}: {flood.sent} messages in {RUN_S:g} s; a good call took "
              f"{1e3 * statistics.median(quiet):.1f} ms before, amid them {1e3 * statistics.median(amid):.1f}, p99 "
              f"{1e3 * p99_s:.1f} ms; {before_mib:.1f} MiB before, at most {most_mib:.1f}, "
              f"{torture.resident_mib(self.daemon.process):.1f} {rest_s:.0f} s after", flush=True)
        self.assertGreater(flood.sent, 0)
        self.assertLess(p99_s, P99_S)
        self.assertLess(most_mib, before_mib + GROWTH_MIB)

    def test_contact_streams(self):
        scene = self.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        request = contact_service_pb2.StreamContactsRequest
        self.attack("/carillon.v1.ContactService/StreamContacts",
                    request(start=contact_service_pb2.ContactStreamStart(scene=scene, step_s=0.01)),
                    repeated(request(steps=[contact_pb2.ContactStep(contacts=[contact_pb2.Contact()])])))

    def test_short_messages_of_many_steps(self):
        scene = self.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        request = contact_service_pb2.StreamContactsRequest
        self.attack("/carillon.v1.ContactService/StreamContacts",
                    request(start=contact_service_pb2.ContactStreamStart(scene=scene, step_s=0.01)),
                    repeated(request(steps=[contact_pb2.ContactStep()]), byte_count=1000))

    def test_renderings(self):
        record = contact_trace_pb2.ContactTraceRecord
        request = audio_service_pb2.RenderRequest
        self.attack("/carillon.v1.AudioService/Render",
                    request(settings=audio_service_pb2.RenderSettings()),
                    repeated(request(record=record(
                        step=contact_pb2.ContactStep(contacts=[contact_pb2.Contact()])))))


if __name__ == "__main__":
    unittest.main()
