# SPDX-License-Identifier: Apache-2.0
"""What the Python package tells its callers without a daemon: warnings, refusals in their own names, short forms; and
which messages a contact stream makes of the steps that wait for a slow network."""

import functools
import inspect
import io
import math
import os
import pathlib
import pickle
import tempfile
import types
import unittest
import warnings
from unittest import mock

import grpc
import numpy

import carillon
from carillon.v1 import (
    audio_service_pb2, contact_pb2, contact_service_pb2, decomposition_pb2, error_pb2, scene_service_pb2, warning_pb2)

POINT, IMPULSE = (0, 0, 0), (0, 0, 1)
MESH = ([(0, 0, 0)], [(0, 0, 0)])


def made(**content):
    return carillon.contacts.make_step(0.0, **content)


class MessagesTest(unittest.TestCase):
    def setUp(self):
        self.c = self.enterContext(carillon.connect("unix:/nowhere"))
        self.scene = carillon.Scene(self.c, "scenes/1")
        self.bell = carillon.SoundingObject(self.scene, scene_service_pb2.SoundingObject(handle=1))

    def refused(self, expected, function, *arguments, **named):
        with self.assertRaises((TypeError, ValueError)) as raised:
            function(*arguments, **named)
        self.assertIn(expected, str(raised.exception))


class WarningsTest(unittest.TestCase):
    def test_warnings_of_the_daemon_are_told_by_their_ids_as_of_the_line_that_uses_the_package(self):
        warning = warning_pb2.Warning(id="POINTS_DISTANT", count=1, figures={"largest_distance_m": 2},
                                      text="a sentence")
        with self.assertWarns(carillon.ContactWarning) as caught:
            carillon.errors.warn_of_contacts([warning])
        self.assertEqual(caught.filename, __file__)
        for told in caught.warning, pickle.loads(pickle.dumps(caught.warning)):
            self.assertEqual((told.id, told.count, told.figures, str(told)),
                             ("POINTS_DISTANT", 1, {"largest_distance_m": 2}, "POINTS_DISTANT: a sentence"))


class RefusalsTest(MessagesTest):

    def test_the_unit_and_the_accuracy_become_settings(self):
        made = carillon.settings.to_settings({"poisson_ratio": 0.3}, "mm", 0.01)
        self.assertEqual((made.poisson_ratio, made.metres_per_unit, made.mesh.accuracy), (0.3, 0.001, 0.01))
        self.assertEqual(carillon.settings.to_settings(None, 2, None).metres_per_unit, 2)
        for expected, wrong in (("unit is 'km'", {"unit": "km"}), ("unit is 0", {"unit": 0}),
                                ("accuracy is 1;", {"accuracy": 1}), ("accuracy is '1%'", {"accuracy": "1%"}),
                                ("unit and settings.metres_per_unit",
                                 {"unit": "mm", "settings": {"metres_per_unit": 1}})):
            self.refused(expected, self.c.create_model, MESH, "oak", **wrong)

    def test_a_value_of_the_wrong_type_is_refused_by_the_name_of_its_argument(self):
        add, trace = functools.partial(self.scene.add, "modalModels/1"), carillon.Trace()
        self.refused("tail_s of render is 'long'; it must be a number", self.c.render, trace, tail_s="long")
        self.refused("handle of add is -1", add, handle=-1)
        self.refused("material is of type int", add, 7)
        self.refused("carillon.material(young_pa=...", add, {"young": 2e11})
        for where, call in (("update", self.bell.update), ("update", self.scene.update),
                            ("set_volume", self.c.set_volume), ("scene", self.c.scene), ("add", add),
                            ("add", functools.partial(trace.add, "modalModels/1"))):
            self.refused(f"gain of {where} is '0.5'; it must be a number", call, gain="0.5")
        self.refused("size of update is 'big'", self.bell.update, size="big")
        self.refused("muted of update is 'no'", self.scene.update, muted="no")
        self.refused("glide is '1'; it must be seconds", self.bell.update, glide="1")
        self.refused("glide is '1'; it must be seconds", self.scene.move_listener, POINT, "1")

    def test_columns_are_refused_by_their_names_with_unit_and_frame(self):
        contacts = carillon.Contacts
        for expected, given in (
                ("points has the shape (2,); it must be N x 3: metres in the stream's frame",
                 contacts(1, (0, 0), IMPULSE)),
                ("impulses is 'no'; it must be newton seconds in the stream's frame", contacts(1, POINT, "no")),
                ("points has 1 row and impulses has 2", contacts(1, POINT, [IMPULSE] * 2)),
                ("durations has the shape (3,)", contacts(1, [POINT] * 2, [IMPULSE] * 2, durations=[1, 2, 3])),
                ("partners has the shape (3,)", contacts(1, [POINT] * 2, [IMPULSE] * 2, partners=[1, 2, 3])),
                ("second_points has 1 row; it must have 2", contacts(1, [POINT] * 2, [IMPULSE] * 2, second_objects=2,
                                                                     second_points=POINT)),
                ("second_objects without second_points", contacts(1, POINT, IMPULSE, second_objects=2)),
                ("second_points is 'no'", contacts(1, POINT, IMPULSE, second_objects=2, second_points="no")),
                ("an entry of objects is None", contacts(None, POINT, IMPULSE)),
                ("it must be real and not complex", contacts(1, POINT, numpy.array([[0, 0, 1 + 0j]]))),
                ("contacts is of type list", [POINT])):
            self.refused(expected, made, contacts=given)
        self.refused("orientations has the shape (3,)", made, poses=carillon.Poses(1, POINT, (0, 0, 1)))
        self.refused("listener is (1, 2)", made, listener=(1, 2))
        for wrong in (-1, 1e-4, 1e4, float("nan"), "slow"):
            self.refused(f"time_scale is {wrong!r}", made, time_scale=wrong)
        for points in (numpy.array([[1j, 0, 0]]), [[numpy.complex128(1j), 0, 0]], [(1j, 0, 0)]):
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                self.refused("points is ", made, contacts=contacts(1, points, IMPULSE))

    def test_one_place_has_the_same_coordinates_for_both_objects_in_the_frame_of_the_scene(self):
        given = carillon.Contacts(1, [(1, 2, 3)], [IMPULSE], second_objects=2)
        trace = carillon.Trace(step=0.01, frame="scene")
        trace.step(0, contacts=given)
        given.second_points = [(4, 5, 6)]
        trace.step(0, contacts=given)
        self.assertEqual([list(step.contact_columns[0].second_point_m) for step in trace.steps], [[1, 2, 3], [4, 5, 6]])

    def test_a_negative_duration_is_refused_and_an_undefined_one_is_left_to_the_daemon(self):
        self.refused("an entry of durations is -5.0", made,
                     impacts=carillon.Impacts(1, POINT, IMPULSE, durations=[-5]))
        self.refused("duration is -5", self.bell.strike, POINT, IMPULSE, -5)
        step = made(impacts=carillon.Impacts(1, [POINT] * 2, [IMPULSE] * 2, durations=[numpy.nan, 0]))
        self.assertEqual(list(step.contact_columns[0].duration_s), [-1, 0])

    def test_a_refusal_is_told_as_the_daemon_wrote_it_with_the_first_remedy(self):
        info = error_pb2.ErrorInfo(reason="INVALID", message="step_s is 0; say",
                                   remedies=[{"field": "settings.mesh.repair", "value": "true"}])
        self.assertEqual(carillon.errors.from_info(info).message,
                         "step_s is 0; say; it may help to set settings.mesh.repair to true")


class ErrorsTest(unittest.TestCase):
    def test_a_refusal_can_be_sent_to_another_process(self):
        remedy = error_pb2.Remedy(field="settings.mesh.repair", value="true")
        for kind in carillon.CarillonError, carillon.ServerUnavailable:
            error = pickle.loads(pickle.dumps(kind("MESH_NOT_CLOSED", "it is open", {"index": "1"}, [remedy])))
            self.assertIs(type(error), kind)
            self.assertEqual((str(error), error.reason, error.message, error.metadata, error.remedies),
                             ("MESH_NOT_CLOSED: it is open", "MESH_NOT_CLOSED", "it is open", {"index": "1"}, [remedy]))

    def test_a_token_crosses_no_network_in_clear(self):
        with mock.patch.dict(os.environ, CARILLON_TOKEN="secret"):
            for server in ("10.0.0.2:50051", "dns:///example.org:1", "127.example.org:1", "[2001:db8::1]:1",
                           "ipv4:10.0.0.2:1"):
                with self.assertRaises(carillon.CarillonError) as refused:
                    carillon.connect(server)
                self.assertEqual(refused.exception.reason, "TLS_REQUIRED")
            for server in ("unix:/nowhere", "unix-abstract:carillon", "localhost:1", "127.0.0.2:1", "[::1]:1",
                           "ipv4:127.0.0.1:1", "ipv6:[::1]:1", "dns:///localhost:1"):
                carillon.connect(server).close()
        with mock.patch.dict(os.environ):
            os.environ.pop("CARILLON_TOKEN", None)
            carillon.connect("10.0.0.2:50051").close()
            with self.assertRaises(carillon.CarillonError):
                carillon.connect("10.0.0.2:50051", token="secret")


class WaitingTest(MessagesTest):

    def test_a_recording_that_ends_early_raises_the_error_of_the_package(self):
        class Lost(grpc.RpcError):
            code = staticmethod(lambda: grpc.StatusCode.UNAVAILABLE)
            details = staticmethod(lambda: "socket closed")
            trailing_metadata = staticmethod(lambda: ())

        def answers(*first):
            yield from first
            raise Lost

        class Call:
            def __init__(self, *first):
                self.answers = answers(*first)

            def __iter__(self):
                return self.answers

            def cancel(self):
                pass

        begin = audio_service_pb2.ListenResponse(format={"sample_rate_hz": 48000, "channel_count": 1})
        self.c.audio_stub = types.SimpleNamespace(Listen=lambda request: Call(begin))
        self.c.contacts_stub = types.SimpleNamespace(
            RecordContacts=lambda request: Call(contact_service_pb2.RecordContactsResponse()))
        for block, arguments in ((self.c.recording(), (1,)),
                                 (self.scene.recording_contacts(), ())):
            with self.assertRaisesRegex(carillon.ServerUnavailable, "no daemon answers at unix:/nowhere"):
                with block as record:
                    record.take(*arguments)


    def test_what_a_recording_heard_stays_when_its_block_is_left_by_an_exception(self):
        class Answers:
            """Five frames in three blocks, of which one was lost before the last; then what stops the program."""

            def __iter__(self):
                yield audio_service_pb2.ListenResponse(format={"sample_rate_hz": 1, "channel_count": 1})
                for first, values, lost in ((100, [1, 2], 0), (102, [3, 4], 0), (105, [5], 1)):
                    yield audio_service_pb2.ListenResponse(block={
                        "first_frame": first, "samples": numpy.array(values, "<f4").tobytes()}, lost_frame_count=lost)

            def cancel(self):
                pass

        self.c.audio_stub = types.SimpleNamespace(Listen=lambda request: Answers())
        with self.assertRaises(KeyboardInterrupt):
            with self.c.recording() as record:
                taken = record.take(3)
                raise KeyboardInterrupt
        self.assertEqual((taken.first_frame, taken.samples.ravel().tolist()), (100, [1, 2, 3]))
        self.assertEqual((record.sound.first_frame, record.sound.samples.ravel().tolist()), (103, [4, 5]))
        self.assertEqual([record.take(1).first_frame, record.take(1).first_frame], [103, 105])
        self.assertEqual(record.sound.samples.size, 0)

    def test_progress_is_told_in_a_line_where_tqdm_is_missing(self):
        job = decomposition_pb2.Job(label="bar (transfer)", state=decomposition_pb2.JOB_STATE_RUNNING,
                                    progress={"phase": decomposition_pb2.PHASE_RADIATE, "fraction": 0.25})
        with mock.patch.dict("sys.modules", {"tqdm": None, "tqdm.auto": None}), \
                mock.patch("sys.stderr", io.StringIO()) as told:
            tell, close = carillon.progress.observer(True, False)
            tell(job)
            job.state = decomposition_pb2.JOB_STATE_SUCCEEDED
            tell(job)
            close()
        self.assertEqual(told.getvalue().split(), "bar (transfer) radiate 25 % bar (transfer) done 100 %".split())


class AioTest(unittest.TestCase):
    def test_every_call_has_its_like_in_asyncio_and_all_that_asks_the_daemon_is_a_coroutine(self):
        aio = carillon.aio
        at_once = {"stream", "recording", "recording_contacts", "perform", "cancel", "in_turn", "forget", "step",
                   "send"}
        for kind, plain in ((aio.AsyncClient, carillon.Client), (aio.AsyncScene, carillon.Scene),
                            (aio.AsyncContactStream, carillon.ContactStream), (aio.AsyncModel, carillon.Model),
                            (aio.AsyncJob, carillon.Job), (aio.AsyncObject, carillon.SoundingObject),
                            (aio.AsyncRecording, carillon.recordings.Recording),
                            (aio.AsyncTraceRecording, carillon.recordings.TraceRecording)):
            for name in dir(plain):
                member = inspect.getattr_static(plain, name)
                if name.startswith(("_", "plot_")) or name in at_once or not callable(getattr(plain, name)):
                    continue
                with self.subTest(kind=kind.__name__, name=name):
                    self.assertFalse(inspect.iscoroutinefunction(getattr(plain, name)) and
                                     isinstance(member, (carillon.faces.call, carillon.faces.items)))
                    like = getattr(kind, name)
                    self.assertTrue(inspect.iscoroutinefunction(like) or inspect.isasyncgenfunction(like))


# What proto/cpp/mesh_file.cc makes of the same files, but for empty lines.
JOINED = (b"*NODE, NSET=all\n**@ 1 data/corners.inc\n1, 0, 0, 0\n**@ 1 data/more.inc\n2, 1, 0, 0\n"
          b"**@ 3 data/corners.inc\n**@ 2 \n** *INCLUDE, INPUT=no\n*STEP\n")


class MeshFilesTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "data").mkdir()

    def read(self, text):
        (self.folder / "bar.inp").write_bytes(text)
        return carillon.meshes.read_mesh(self.folder / "bar.inp").data

    def test_an_input_of_abaqus_comes_with_the_files_that_it_includes(self):
        (self.folder / "data/corners.inc").write_text('1, 0, 0, 0\n*Include, input="data/more.inc"\n')
        (self.folder / "data/more.inc").write_text("2, 1, 0, 0")
        self.assertEqual(self.read(b"*NODE, INPUT = data\\corners.inc, NSET=all\r\n** *INCLUDE, INPUT=no\n*STEP\n"),
                         JOINED)

    def test_an_included_file_must_be_there_in_the_folder_and_not_include_itself(self):
        for name in ("../bar.inc", "/etc/passwd", "bar.inp"):
            with self.assertRaisesRegex(carillon.CarillonError, name):
                self.read(f"*INCLUDE, INPUT={name}\n".encode())
        with self.assertRaises(FileNotFoundError):
            self.read(b"*INCLUDE, INPUT=gone.inc\n")

    def test_the_two_files_of_tetgen_may_have_names_in_capitals(self):
        (self.folder / "BODY.NODE").write_text("nodes\n")
        (self.folder / "BODY.ELE").write_text("elements\n")
        for name in ("BODY.NODE", "BODY.ELE"):
            self.assertEqual(carillon.meshes.read_mesh(self.folder / name).data, b"nodes\nelements\n")


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
