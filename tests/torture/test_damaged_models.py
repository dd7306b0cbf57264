# SPDX-License-Identifier: Apache-2.0
"""Damaged models are imported, and damaged traces rendered: each ends with an answer or a reason, and the daemon
keeps its process and its memory.

CARILLON_TORTURE_COUNT and CARILLON_TORTURE_SEED choose how many of each, and the first seed of their damage.
"""

import collections
import ctypes
import itertools
import os
import random
import sys
import time
import unittest

import grpc
from google.protobuf.descriptor import FieldDescriptor

import meshes
import torture
from carillon.v1 import (
    audio_service_pb2, contact_pb2, contact_trace_pb2, hearing_pb2, material_pb2, modal_model_service_pb2)
from test_damaged_meshes import change_bytes

# Beyond it a call counts as hanging.
LIMIT_S = 60
# A damaged trace may be long. Its client goes away after these answers.
MOST_ANSWERS = 50
# A daemon that has read and rendered one good model and trace takes at most so much more after the others.
GROWTH_MIB = 32
# The daemon gives freed memory back every 5 s.
REST_S = 12
MATERIAL = material_pb2.Material(preset=meshes.MATERIAL)
NUMBERS = (0, -1, 1, 1e-320, 1e-9, 20, 1e6, 1e20, 3e38, -3e38, float("inf"), float("nan"), 2**31, 2**32 - 1, 2**63)
FLOATING = (FieldDescriptor.CPPTYPE_DOUBLE, FieldDescriptor.CPPTYPE_FLOAT)
NAME = "modalModels/" + "d" * 64

xxhash = ctypes.CDLL("libxxhash.so.0")
xxhash.XXH3_64bits.restype = ctypes.c_uint64


def seal(request):
    """Gives a chunk the right hash, without which no damage is read."""
    if request.record.HasField("chunk"):
        data = request.record.chunk.data
        request.record.chunk.xxh3 = xxhash.XXH3_64bits(data, ctypes.c_size_t(len(data)))


def leaves(message):
    """(message, field) of each field that is set and is no message."""
    for field, value in message.ListFields():
        repeated = field.label == FieldDescriptor.LABEL_REPEATED
        if field.cpp_type != FieldDescriptor.CPPTYPE_MESSAGE:
            yield message, field
        elif not (repeated and field.message_type.GetOptions().map_entry):
            for inner in value if repeated else (value,):
                yield from leaves(inner)


def other_value(value, field, chance):
    if isinstance(value, (bytes, str)):
        data = change_bytes(value if isinstance(value, bytes) else value.encode(), chance)
        return data if isinstance(value, bytes) else data.decode(errors="ignore")
    number = chance.choice(NUMBERS)
    return number if field.cpp_type in FLOATING else int(max(-9e18, min(9e18, number))) if number == number else 7


def change_field(message, chance):
    """One field gets another value; one that cannot have it stays."""
    owner, field = chance.choice(list(leaves(message)) or [(message, None)])
    if field is None:
        return
    old = getattr(owner, field.name)
    try:
        if field.label == FieldDescriptor.LABEL_REPEATED:
            at = chance.randrange(len(old))
            old[at] = other_value(old[at], field, chance)
        else:
            setattr(owner, field.name, other_value(old, field, chance))
    except (ValueError, OverflowError):
        pass


def damaged(requests, chance):
    """The messages with one to four faults, as bytes."""
    requests = [type(request).FromString(request.SerializeToString()) for request in requests]
    for _ in range(chance.choice((1, 1, 2, 4))):
        at = chance.randrange(len(requests))
        kind = chance.randrange(10)
        if kind < 6:
            change_field(requests[at], chance)
        elif kind == 6 and len(requests) > 1:
            del requests[at]
        elif kind == 7:
            requests.insert(at, requests[chance.randrange(len(requests))])
        elif kind == 8:
            other = chance.randrange(len(requests))
            requests[at], requests[other] = requests[other], requests[at]
    for request in requests:
        if hasattr(request, "name") and chance.randrange(8) > 0:
            seal(request)
    messages = [request.SerializeToString() for request in requests]
    if chance.randrange(8) == 0:
        at = chance.randrange(len(messages))
        messages[at] = change_bytes(messages[at], chance)
    return messages


class DamagedModelTest(torture.ServedTest):
    def setUp(self):
        super().setUp()
        self.serve()
        self.channel = grpc.insecure_channel(self.daemon.server)
        self.addCleanup(self.channel.close)
        self.model = self.client.wait(self.client.create(meshes.bar(), "obj", material=MATERIAL))
        self.first = int(os.environ.get("CARILLON_TORTURE_SEED", "0"))
        self.count = int(os.environ.get("CARILLON_TORTURE_COUNT", torture.rounds(60, 50_000)))

    def stored(self):
        """The model as it is imported."""
        answers = self.client.models.ExportModalModel(modal_model_service_pb2.ExportModalModelRequest(name=self.model))
        requests = [modal_model_service_pb2.ImportModalModelRequest(record=answer.record) for answer in answers]
        requests[0].name = NAME
        return requests

    def trace(self, model):
        record = contact_trace_pb2.ContactTraceRecord
        records = [record(header=contact_trace_pb2.ContactTraceHeader(
                       format_version=1, step_s=0.01, hearing=hearing_pb2.Hearing(reference_distance_m=1))),
                   record(object=contact_trace_pb2.ContactTraceObject(handle=1, modal_model=model, material=MATERIAL))]
        for number in range(3):
            step = contact_pb2.ContactStep(time_s=0.01 * number)
            step.contacts.add(kind=contact_pb2.CONTACT_KIND_IMPACT, object=1, duration_s=0.001,
                              point_m=contact_pb2.Vec3(z=meshes.BAR_SIZE[2]),
                              impulse_newton_seconds=contact_pb2.Vec3(z=-1e-3))
            step.contact_columns.add(kind=contact_pb2.CONTACT_KIND_IMPACT, object=[1],
                                     point_m=(0.01, 0.01, meshes.BAR_SIZE[2]), impulse_newton_seconds=(0, 0, -1e-3))
            records.append(record(step=step))
        request = audio_service_pb2.RenderRequest
        return [request(settings=audio_service_pb2.RenderSettings(tail_s=0.05)),
                *(request(record=one) for one in records)]

    def end_of(self, call):
        """How a call ended: "OK", or the reason of its refusal."""
        try:
            for _ in itertools.islice(call, MOST_ANSWERS):
                pass
            call.cancel()
            return "OK"
        except grpc.RpcError as error:
            reason, _, repair = error.details().partition(": ")
            self.assertNotIn(error.code(), (grpc.StatusCode.UNKNOWN, grpc.StatusCode.INTERNAL,
                                            grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED), error)
            self.assertTrue(repair, error)
            return reason

    def render(self, messages):
        return self.end_of(self.channel.stream_stream("/carillon.v1.AudioService/Render")(
            iter(messages), timeout=LIMIT_S))

    def import_model(self, messages):
        end = self.end_of(self.channel.stream_stream("/carillon.v1.ModalModelService/ImportModalModel")(
            iter(messages), timeout=LIMIT_S))
        if end == "OK":
            # It is read in another way when it sounds.
            end = "rendered: " + self.render([request.SerializeToString() for request in self.trace(NAME)])
            self.client.models.DeleteModalModel(modal_model_service_pb2.DeleteModalModelRequest(name=NAME))
        return end

    def attack(self, requests, act, kind):
        self.assertIn("OK", act([request.SerializeToString() for request in requests]))
        time.sleep(REST_S)
        before_mib = torture.resident_mib(self.daemon.process)
        ends = collections.Counter()
        for seed in range(self.first, self.first + self.count):
            with self.subTest(seed=seed):
                ends[act(damaged(requests, random.Random(seed)))] += 1
                self.assertIsNone(self.daemon.process.poll(), "the daemon has ended")
        time.sleep(REST_S)
        print(f"{self.count} damaged {kind}: {dict(ends.most_common())}; {before_mib:.1f} MiB before, "
              f"{torture.resident_mib(self.daemon.process):.1f} after", file=sys.stderr)
        self.assertGreater(len(ends), 2)
        self.assertLess(torture.resident_mib(self.daemon.process), before_mib + GROWTH_MIB)

    def test_each_model_is_imported_or_refused(self):
        self.attack(self.stored(), self.import_model, "models")

    def test_each_trace_is_rendered_or_refused(self):
        self.attack(self.trace(self.model), self.render, "traces")


if __name__ == "__main__":
    unittest.main()
