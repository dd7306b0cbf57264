# SPDX-License-Identifier: Apache-2.0
"""Which messages a contact stream of the Python package makes of the steps that wait for a slow network."""

import math
import unittest

import numpy

import carillon
from carillon.v1 import contact_pb2, contact_service_pb2

START = contact_service_pb2.ContactStreamStart(scene="scenes/1", step_s=0.01)


class SlowStub:
    """Keeps the requests of a stream, which nobody takes before the test does, and is the daemon's answer: none."""

    def StreamContacts(self, requests):
        self.requests = requests
        return self

    def __iter__(self):
        return iter(())

    def cancel(self):
        pass


class StreamTest(unittest.TestCase):
    def open_stream(self):
        client = carillon.connect("unix:/nowhere")
        client.contacts_stub = self.stub = SlowStub()
        return carillon.ContactStream(client, START)

    def requests_of(self, row_counts):
        """The requests after the start, for steps that all wait and have these numbers of rows."""
        stream = self.open_stream()
        for number, count in enumerate(row_counts):
            row = contact_pb2.Contact(kind=contact_pb2.CONTACT_KIND_IMPACT, object=1, duration_s=1e-3)
            stream.send(contact_pb2.ContactStep(time_s=0.01 * number, contacts=[row] * count))
        stream.close(warn=False)
        requests = list(self.stub.requests)
        self.assertEqual(requests.pop(0).start, START)
        return requests

    def test_a_step_whose_time_is_too_large_or_goes_back_is_refused_at_once_and_the_next_one_is_taken(self):
        def refused(expected, send, argument):
            with self.assertRaisesRegex(carillon.CarillonError, expected) as raised:
                send(argument)
            self.assertEqual(raised.exception.reason, "INVALID_STREAM")

        stream, trace = self.open_stream(), carillon.Trace()
        for target in stream, trace:
            for time in (math.nan, math.inf, -1.1e10):
                refused("the time of step 0 is", target.step, time)
            # A simulation may begin at a time below zero, and two steps may have the same time.
            for time in (-1, numpy.float32(2), numpy.array([2.0])):
                target.step(time)
            refused(r"from 2 s to 1\.5 s at step 3;", target.step, 1.5)
            target.step(3)
        refused(r"from 3 s to 1\.5 s at step 4;", stream.send, contact_pb2.ContactStep(time_s=1.5))
        trace.step(1795853690.812)
        refused(r"from 1795853690\.812 s to 1795853690\.5 s at step 5;", trace.step, 1795853690.5)
        for wrong in (None, "2.5", b"2.5", [2.5, 3]):
            with self.assertRaisesRegex(ValueError, "time is "):
                stream.step(wrong)
        stream.close(warn=False)
        steps = [step for request in self.stub.requests for step in request.steps]
        self.assertEqual([step.time_s for step in steps], [-1, 2, 2, 3])
        self.assertEqual([step.time_s for step in trace.steps[:4]], [-1, 2, 2, 3])

    def test_small_steps_that_wait_are_sent_together_and_in_order(self):
        requests = self.requests_of([1] * 1000)
        times = [step.time_s for request in requests for step in request.steps]
        self.assertEqual(times, [0.01 * number for number in range(1000)])
        self.assertEqual([len(request.steps) for request in requests], [256, 256, 256, 232])

    def test_a_step_that_does_not_fit_comes_in_the_next_message(self):
        requests = self.requests_of([1, 100_000, 1, 1])
        self.assertEqual([len(request.steps) for request in requests], [1, 1, 2])
        self.assertLess(max(request.ByteSize() for request in requests), 2 << 20)
        self.assertEqual(len(requests[1].steps[0].contacts), 100_000)

    def test_a_stream_of_one_step_or_none_ends(self):
        self.assertEqual(self.requests_of([]), [])
        self.assertEqual([len(request.steps) for request in self.requests_of([3])], [1])
