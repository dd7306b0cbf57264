# SPDX-License-Identifier: Apache-2.0
"""The C interface: the page's program, compiled as C99 against what is installed, and calls that go wrong."""

import ctypes
import os
import re
import subprocess

import numpy

import carillon
import meshes
from daemon import BUILD, ROOT, DaemonTest, wait_until

BAR = meshes.box((0.2, 0.03, 0.01))


class Vec3(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in "xyz"]


class Mesh(ctypes.Structure):
    _fields_ = [("vertices_m", ctypes.c_void_p), ("vertex_count", ctypes.c_size_t), ("triangles", ctypes.c_void_p),
                ("triangle_count", ctypes.c_size_t)]


class Object(ctypes.Structure):
    _fields_ = [("model", ctypes.c_char_p), ("material", ctypes.c_char_p), ("size", ctypes.c_double),
                ("gain", ctypes.c_double), ("handle", ctypes.c_uint32)]


class Contact(ctypes.Structure):
    _fields_ = [("kind", ctypes.c_int32), ("object", ctypes.c_uint32), ("point_m", Vec3), ("impulse", Vec3),
                ("force", Vec3), ("partner", ctypes.c_uint32), ("duration_s", ctypes.c_double),
                ("travel_speed_m_per_s", ctypes.c_double), ("roughness_depth", ctypes.c_double), ("normal", Vec3)]


IMPACT, FORCE = 1, 2


def impact(handle, point, impulse, duration_s=0.0):
    return Contact(IMPACT, handle, point, impulse, duration_s=duration_s)


def blow(handle):
    """A strike at an end of the bar."""
    return impact(handle, Vec3(0.2, 0.015, 0.01), Vec3(0, 0, -0.01), 1e-4)


def installed(folder):
    """The clients of C++ and C, installed in a folder; returns the library for C."""
    subprocess.run(["cmake", "--install", BUILD, "--component", "sdk", "--prefix", folder], check=True,
                   stdout=subprocess.DEVNULL)
    return next(folder.rglob("libcarillon.so"))


class Quaternion(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in "wxyz"]


class Pose(ctypes.Structure):
    _fields_ = [("object", ctypes.c_uint32), ("position_m", Vec3), ("orientation", Quaternion)]


class Step(ctypes.Structure):
    _fields_ = [("time_s", ctypes.c_double), ("contacts", ctypes.POINTER(Contact)), ("contact_count", ctypes.c_size_t),
                ("poses", ctypes.POINTER(Pose)), ("pose_count", ctypes.c_size_t), ("listener", ctypes.POINTER(Pose)),
                ("time_scale", ctypes.c_double)]


class Hearing(ctypes.Structure):
    EFFECTS = ("distance_gain", "propagation_delay", "panning", "directivity", "near_field", "binaural")
    _fields_ = [*((name, ctypes.c_int32) for name in EFFECTS), ("reference_distance_m", ctypes.c_double),
                ("sound_speed_m_per_s", ctypes.c_double), ("listener", Pose)]


class Report(ctypes.Structure):
    _fields_ = [(name + "_count", ctypes.c_uint64) for name in ("step", "accepted", "late", "rejected", "dropped_step")]


class Registration(ctypes.Structure):
    _fields_ = [("id", ctypes.c_char_p), ("hearing", ctypes.c_void_p), ("objects", ctypes.POINTER(Object)),
                ("object_count", ctypes.c_size_t)]


class RenderSettings(ctypes.Structure):
    _fields_ = [("sample_rate_hz", ctypes.c_uint32), ("channel_count", ctypes.c_uint32), ("tail_s", ctypes.c_double)]


class Sound(ctypes.Structure):
    _fields_ = [("samples", ctypes.POINTER(ctypes.c_float)), ("frame_count", ctypes.c_uint64),
                ("channel_count", ctypes.c_uint32), ("sample_rate_hz", ctypes.c_uint32)]


class CClientTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.prefix = cls.folder / "carillon"
        cls.library = installed(cls.prefix)
        cls.calls = calls = ctypes.CDLL(str(cls.library))
        for text in (calls.carillon_error, calls.carillon_error_reason, calls.carillon_warnings,
                     calls.carillon_scene_name):
            text.restype = ctypes.c_char_p
        calls.carillon_open_stream.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_int32, ctypes.c_void_p]
        calls.carillon_create_trace.argtypes = [ctypes.c_char_p, ctypes.c_double, ctypes.c_int32, ctypes.c_void_p,
                                                ctypes.c_void_p]
        cls.connection = ctypes.c_void_p()
        assert calls.carillon_connect(cls.daemon.server.encode(), ctypes.byref(cls.connection)) == 0
        cls.addClassCleanup(calls.carillon_disconnect, cls.connection)
        corners, indices = numpy.array(BAR[0], "f8"), numpy.array(BAR[1], "u4")
        cls.model = ctypes.create_string_buffer(96)
        mesh = Mesh(corners.ctypes.data, len(corners), indices.ctypes.data, len(indices))
        assert calls.carillon_create_model_of_mesh(cls.connection, ctypes.byref(mesh), meshes.MATERIAL.encode(),
                                                   cls.model) == 0, calls.carillon_error()

    def done(self, code):
        self.assertEqual(code, 0, self.calls.carillon_error())

    def refused(self, code, pattern):
        """The call with this result was refused as invalid, with an error that matches."""
        self.assertEqual(code, 3)
        self.assertRegex(self.calls.carillon_error(), pattern)

    def make(self, function, *arguments):
        """What a function of the library makes."""
        made = ctypes.c_void_p()
        self.done(function(*arguments, ctypes.byref(made)))
        return made

    def make_scene(self):
        scene = self.make(self.calls.carillon_create_scene, self.connection, None)
        self.addCleanup(self.calls.carillon_delete_scene, scene)
        return scene

    def open_stream(self, scene):
        return self.make(self.calls.carillon_open_stream, scene, 1 / 60, 0)

    def send(self, stream, *contacts):
        """The result of a step with these contacts."""
        rows = (Contact * len(contacts))(*contacts)
        return self.calls.carillon_send(stream, ctypes.byref(Step(contacts=rows, contact_count=len(rows))))

    def bar(self, handle=0):
        return Object(self.model.value, meshes.MATERIAL.encode(), handle=handle)

    def test_the_program_of_the_page_strikes_a_bell(self):
        page = (ROOT / "docs/ten_minutes_c.md").read_text()
        (self.folder / "strike.c").write_text(re.search(r"(?ms)^```c\n(.*?)^```", page)[1])
        self.daemon.command("example", "bowl", "--out", self.folder / "bowl.obj")
        compiles = re.search(r"(?m)^    libraries=.*\n    gcc .*\n", page)[0]
        options = {"cwd": self.folder, "text": True,
                   "env": {**os.environ, "CARILLON_SERVER": self.daemon.server, "HOME": str(self.folder)}}
        subprocess.run(["bash", "-euc", compiles.replace("gcc", "gcc -pedantic -Wall -Wextra -Werror")], check=True,
                       **options)
        subprocess.run(["./strike", "bowl.obj"], check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                       **options)
        with self.c.recording() as heard:
            with subprocess.Popen(["./strike", "bowl.obj"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                  **options) as striker:
                heard.take(2.0)
                said = striker.communicate("\n")[0]
            self.assertEqual((striker.returncode, said), (0, "strikes in time: 1\n"))
            self.assertGreater(heard.sound.peak, 1e-4)
        failed = subprocess.run(["./strike", "none.obj"], check=False, stdin=subprocess.DEVNULL, capture_output=True,
                                **options)
        self.assertEqual(failed.returncode, 1)
        self.assertIn("strike: FILE_NOT_FOUND: none.obj", failed.stderr)

    def test_what_is_probably_wrong_with_contacts_is_told(self):
        scene, handle, report = self.make_scene(), ctypes.c_uint32(), Report()
        self.done(self.calls.carillon_add_object(scene, ctypes.byref(self.bar()), ctypes.byref(handle)))

        def warnings_of(*impacts):
            stream = self.open_stream(scene)
            self.done(self.send(stream, *impacts))
            for name in ("contact_count", "pose_count"):
                self.refused(self.calls.carillon_send(stream, ctypes.byref(Step(**{name: 3}))),
                             b"^INVALID_SETTINGS: an array of the step is a null pointer")
            self.done(self.calls.carillon_close_stream(stream, ctypes.byref(report)))
            return self.calls.carillon_warnings().decode().splitlines()

        point, push = Vec3(0.1, 0.015, 0.01), Vec3(0, 0, -1e-3)
        self.assertEqual(warnings_of(impact(handle, point, push)), [])
        far, lost = warnings_of(impact(99, point, push), impact(handle, Vec3(100, 15, 10), push))[::-1]
        self.assertRegex(far, "^POINTS_DISTANT: ")
        self.assertRegex(lost, "^CONTACTS_REJECTED: .* OBJECT_NOT_FOUND: ")
        for wrong in (Contact(3, handle, point, push), Contact(IMPACT, handle, point, Vec3(), push),
                      Contact(0, handle, point, push, push), Contact(FORCE, handle, point, push)):
            stream = self.open_stream(scene)
            self.refused(self.send(stream, wrong), b"^INVALID_SETTINGS: .* contact")
            self.done(self.calls.carillon_close_stream(stream, None))
        for step_s in (0, -1, 10, float("nan")):
            self.refused(self.calls.carillon_create_trace(b"x.contacts", step_s, 0, None, ctypes.byref(stream)),
                         b"^INVALID_STREAM: step_s is .* from 1e-6 to 1 s")

    def test_what_the_daemon_cannot_read_is_refused_with_a_reason(self):
        scene, sound = self.make_scene(), Sound()
        registration = Registration(b"large", None, None, 0)
        lasting = self.make(self.calls.carillon_register_scene, self.connection, ctypes.byref(registration))
        self.addCleanup(self.calls.carillon_delete_scene, lasting)
        many = [impact(1, Vec3(1, 1, 1), Vec3(1, 1, 1))] * 100_000
        for struck in (scene, lasting):
            stream = self.open_stream(struck)
            self.refused(self.send(stream, *many), b"^STEP_TOO_LARGE: a step of .* bytes: the daemon takes at most")
            self.done(self.send(stream))  # the stream goes on
            self.done(self.calls.carillon_close_stream(stream, None))
        bar = Object(b"modalModels/\xff", meshes.MATERIAL.encode())
        self.assertEqual(self.calls.carillon_add_object(scene, ctypes.byref(bar), None), 12)
        self.assertRegex(self.calls.carillon_error(), b"^REQUEST_MALFORMED: .* text in UTF-8")
        file = str(self.folder / "empty.contacts").encode()
        self.done(self.calls.carillon_close_trace(self.make(self.calls.carillon_create_trace, file, 1 / 60, 0, None)))
        self.refused(self.calls.carillon_render(self.connection, file, None, ctypes.byref(sound)), b"^TRACE_EMPTY: ")

    def test_only_functions_of_the_header_are_exported(self):
        listed = subprocess.run(["nm", "-D", "--defined-only", self.library], check=True, capture_output=True,
                                text=True).stdout
        exported = {line.split()[-1] for line in listed.splitlines()}
        header = (self.prefix / "include/carillon.h").read_text()
        declared = set(re.findall(r"^(?:carillon_code|void|const char\*) (carillon_\w+)\(", header, re.MULTILINE))
        self.assertEqual(exported, declared)

    def write_trace(self, name, steps, frame=0, hearing=None):
        """A trace of the bar. `steps` makes them for its handle. Returns its file."""
        file, handle = str(self.folder / name), ctypes.c_uint32()
        trace = self.make(self.calls.carillon_create_trace, file.encode(), 1 / 60, frame, hearing)
        self.done(self.calls.carillon_trace_object(trace, ctypes.byref(self.bar()), ctypes.byref(handle)))
        for step in steps(handle):
            self.done(self.calls.carillon_trace_step(trace, ctypes.byref(step)))
        self.done(self.calls.carillon_close_trace(trace))
        return file

    def render(self, file, channel_count=1):
        sound = Sound()
        settings = RenderSettings(44100, channel_count, 0.5)
        self.done(self.calls.carillon_render(self.connection, file.encode(), ctypes.byref(settings),
                                             ctypes.byref(sound)))
        samples = numpy.ctypeslib.as_array(sound.samples, (sound.frame_count, sound.channel_count)).copy()
        self.calls.carillon_free_sound(ctypes.byref(sound))
        return samples

    def test_a_trace_renders_to_the_samples_that_python_gets(self):
        file = self.write_trace("c.contacts", lambda handle: [Step(0.0, ctypes.pointer(blow(handle)), 1)])
        same = self.c.render(file, sample_rate_hz=44100, tail_s=0.5)
        # Equal arrays are one model, from whichever language they come.
        self.assertEqual(self.c.create_model(BAR, meshes.MATERIAL).name, self.model.value.decode())
        self.assertGreater(same.peak, 1e-5)
        numpy.testing.assert_array_equal(self.render(file), same.samples)

    def test_an_oblique_blow_with_a_normal_renders_to_the_samples_that_python_gets(self):
        point, push = (0.2, 0.015, 0.01), (0.008, 0, -0.01)

        def steps(handle):
            struck = impact(handle, Vec3(*point), Vec3(*push))
            struck.normal = Vec3(0, 0, 1)
            return [Step(0.0, ctypes.pointer(struck), 1)]

        heard = []
        for normals in ([(0, 0, 1)], None):
            trace = carillon.Trace(1 / 60)
            handle = trace.add(self.model.value.decode(), meshes.MATERIAL)
            trace.step(0, impacts=carillon.Impacts(handle, point, push, normals=normals))
            heard.append(self.c.render(trace, sample_rate_hz=44100, tail_s=0.5))
        numpy.testing.assert_allclose(self.render(self.write_trace("oblique.contacts", steps)), heard[0].samples,
                                      atol=1e-4 * heard[0].peak)
        self.assertGreater(abs(heard[0].samples - heard[1].samples).max(), 1e-2 * heard[0].peak)

    def test_a_trace_in_slow_motion_and_with_a_pause_renders_to_the_samples_that_python_gets(self):
        def steps(handle):
            return [Step(0.125 * i, ctypes.pointer(blow(handle)), 1, time_scale=scale)
                    for i, scale in enumerate((0, 0.25, -1, 4))]

        trace = carillon.Trace(1 / 60)
        handle = trace.add(self.model.value.decode(), meshes.MATERIAL)
        for i, scale in enumerate((None, 0.25, 0, 4)):
            trace.step(0.125 * i, impacts=carillon.Impacts(handle, (0.2, 0.015, 0.01), (0, 0, -0.01), durations=1e-4),
                       time_scale=scale)
        samples = self.render(self.write_trace("slow.contacts", steps))
        same = self.c.render(trace, sample_rate_hz=44100, tail_s=0.5)
        # Columns have floats, and rows doubles.
        numpy.testing.assert_allclose(samples, same.samples, atol=1e-4 * same.peak)
        self.assertAlmostEqual(len(samples) / 44100, 0.5 + 1 / 60 + 0.125 / 4 + 0.5, delta=0.005)

    def test_a_placed_bar_is_heard_from_its_place(self):
        """The bar is 2 m to the right of the listener, who looks along -z from z = 1 m."""
        at, here = Vec3(2, 0, 1), Vec3(0.2, 0.015, 0.01)
        hearing = Hearing(distance_gain=1, propagation_delay=1, panning=1, listener=Pose(0, Vec3(0, 0, 1)))

        def heard(point, frame=0, listener=None, hearing=ctypes.byref(hearing)):
            def steps(handle):
                pose, struck = Pose(handle, at), impact(handle, point, Vec3(0, 0, -0.01), 1e-4)
                return [Step(0.0, ctypes.pointer(struck), 1, ctypes.pointer(pose), 1,
                             listener and ctypes.pointer(listener))]
            return self.render(self.write_trace("placed.contacts", steps, frame, hearing), 2).T

        left, right = heard(here)
        self.assertGreater(abs(right).max(), 1e-5)
        self.assertLess(abs(left).max(), 1e-3 * abs(right).max())
        # The same point in the frame of the scene gives the same sound.
        again = heard(Vec3(here.x + at.x, here.y + at.y, here.z + at.z), frame=1)[1]
        numpy.testing.assert_allclose(again, right, atol=1e-3 * abs(right).max())
        # A listener who has turned round hears it from the left.
        turned = heard(here, listener=Pose(0, Vec3(0, 0, 1), Quaternion(0, 0, 1, 0)))
        numpy.testing.assert_allclose(turned[0], right, atol=1e-3 * abs(right).max())
        # Without a hearing the bar sounds at 1 m, at once, and on both channels.
        plain = heard(here, hearing=None)
        numpy.testing.assert_array_equal(*plain)
        delay = int(2 / 343 * 44100)
        first = [numpy.flatnonzero(abs(sound) > 0.05 * abs(sound).max())[0] for sound in (plain[0], right)]
        self.assertAlmostEqual(first[1] - first[0], delay, delta=20)

    def test_hearings_and_frames_that_are_none_are_refused(self):
        made, hearing = ctypes.c_void_p(), Hearing(near_field=1)
        self.refused(self.calls.carillon_create_scene(self.connection, ctypes.byref(hearing), ctypes.byref(made)),
                     b"^INVALID_SETTINGS: ")
        self.assertEqual(self.calls.carillon_error_reason(), b"INVALID_SETTINGS")
        self.refused(self.calls.carillon_create_trace(str(self.folder / "x").encode(), 0.01, 7, None,
                                                      ctypes.byref(made)), b"the frame is 7")

    def test_a_registered_scene_outlives_its_daemon(self):
        bars = (Object * 2)(self.bar(5), self.bar(9))
        registration = Registration(b"lathe-1", None, bars, 2)
        scene, again = (self.make(self.calls.carillon_register_scene, self.connection, ctypes.byref(registration))
                        for _ in range(2))
        for made in (scene, again):
            self.assertEqual(self.calls.carillon_scene_name(made), b"scenes/lathe-1")
        stream = self.open_stream(scene)
        self.daemon.kill()
        self.daemon.start()
        step, report = Step(0.0), Report()

        def handles():
            step.time_s += 0.01
            self.done(self.calls.carillon_send(stream, ctypes.byref(step)))
            with carillon.connect(self.daemon.server) as c:
                return [item.handle for scene_there in c.scenes() for item in scene_there.objects()]

        def struck_count():
            nonlocal stream
            self.done(self.calls.carillon_send(stream, ctypes.byref(step)))
            self.done(self.calls.carillon_close_stream(stream, ctypes.byref(report)))
            stream = self.open_stream(scene)
            return report.accepted_count + report.late_count

        wait_until(lambda: handles() == [5, 9])
        step.contacts, step.contact_count, step.time_s = ctypes.pointer(blow(9)), 1, step.time_s + 0.01
        wait_until(struck_count)
        self.assertEqual(report.accepted_count + report.late_count, 1)
        self.calls.carillon_close_stream(stream, None)
        self.calls.carillon_delete_scene(again)
        self.calls.carillon_delete_scene(scene)
