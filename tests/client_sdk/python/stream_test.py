#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Which messages a contact stream of the Python package makes of the steps that wait for a slow network."""

import types
import unittest

import carillon
from carillon.v1 import contact_pb2, contact_service_pb2

START = contact_service_pb2.ContactStreamStart(scene="scenes/1", step_s=0.01)


class SlowStub:
    """Keeps the requests of a stream, which nobody takes before the test does."""

    def StreamContacts(self, requests):
        self.requests = requests
        return iter(())


class StreamTest(unittest.TestCase):
    def requests_of(self, row_counts):
        """The requests after the start, for steps that all wait and have these numbers of rows."""
        stub = SlowStub()
        client = types.SimpleNamespace(server="unix:/nowhere", contacts_stub=stub)
        stream = carillon.ContactStream(types.SimpleNamespace(client=client), START)
        for number, count in enumerate(row_counts):
            row = contact_pb2.Impulse(object=1, duration_s=1e-3)
            stream.send(contact_pb2.ContactStep(time_s=0.01 * number, impulses=[row] * count))
        stream.close(warn=False)
        requests = list(stub.requests)
        self.assertEqual(requests.pop(0).start, START)
        return requests

    def test_small_steps_that_wait_are_sent_together_and_in_order(self):
        requests = self.requests_of([1] * 1000)
        times = [step.time_s for request in requests for step in request.steps.steps]
        self.assertEqual(times, [0.01 * number for number in range(1000)])
        self.assertEqual([len(request.steps.steps) for request in requests], [256, 256, 256, 232])

    def test_a_step_that_does_not_fit_comes_in_the_next_message(self):
        requests = self.requests_of([1, 100_000, 1, 1])
        self.assertEqual([request.WhichOneof("request") for request in requests], ["step", "step", "steps"])
        self.assertLess(max(request.ByteSize() for request in requests), 2 << 20)
        self.assertEqual(len(requests[1].step.impulses), 100_000)

    def test_a_stream_of_one_step_or_none_ends(self):
        self.assertEqual(self.requests_of([]), [])
        self.assertEqual([request.WhichOneof("request") for request in self.requests_of([3])], ["step"])


if __name__ == "__main__":
    unittest.main()
