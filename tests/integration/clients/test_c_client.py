# SPDX-License-Identifier: Apache-2.0
"""The C interface: the page's program, compiled as C99 against what is installed, and calls that go wrong."""

import ctypes
import os
import pathlib
import re
import subprocess
import time
import unittest

import numpy

import carillon
import meshes
from daemon import ROOT, DaemonTest

BUILD = pathlib.Path(os.environ["CARILLON_BUILD_DIR"])
VERTICES = [(x, y, z) for x in (0, 0.2) for y in (0, 0.03) for z in (0, 0.01)]
TRIANGLES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6),
             (0, 6, 4), (1, 5, 7), (1, 7, 3)]


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
                ("travel_speed_m_per_s", ctypes.c_double), ("roughness_depth", ctypes.c_double)]


IMPACT, FORCE = 1, 2


def impact(handle, point, impulse, duration_s=0.0):
    return Contact(IMPACT, handle, point, impulse, duration_s=duration_s)


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
        cls.prefix = cls.folder / "prefix"
        subprocess.run(["cmake", "--install", BUILD, "--component", "sdk", "--prefix", cls.prefix], check=True,
                       stdout=subprocess.DEVNULL)
        cls.library = next(cls.prefix.rglob("libcarillon.so"))
        cls.c = ctypes.CDLL(str(cls.library))
        for text in (cls.c.carillon_error, cls.c.carillon_error_reason, cls.c.carillon_warnings):
            text.restype = ctypes.c_char_p
        cls.c.carillon_scene_name.restype = ctypes.c_char_p
        cls.c.carillon_open_stream.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_int32, ctypes.c_void_p]
        cls.c.carillon_create_trace.argtypes = [ctypes.c_char_p, ctypes.c_double, ctypes.c_int32, ctypes.c_void_p,
                                                ctypes.c_void_p]
        cls.connection = ctypes.c_void_p()
        assert cls.c.carillon_connect(cls.daemon.server.encode(), ctypes.byref(cls.connection)) == 0

    @classmethod
    def tearDownClass(cls):
        cls.c.carillon_disconnect(cls.connection)

    def model_of_arrays(self, vertices, triangles):
        corners, indices = numpy.array(vertices, "f8"), numpy.array(triangles, "u4")
        name = ctypes.create_string_buffer(96)
        mesh = Mesh(corners.ctypes.data, len(corners), indices.ctypes.data, len(indices))
        code = self.c.carillon_create_model_of_mesh(self.connection, ctypes.byref(mesh), meshes.MATERIAL.encode(), name)
        return code, name.value.decode()

    def test_the_program_of_the_page_strikes_a_bell(self):
        page = (ROOT / "docs/ten_minutes_c.md").read_text()
        (self.folder / "strike.c").write_text(re.search(r"(?ms)^```c\n(.*?)^```", page)[1])
        (self.folder / "bowl.obj").write_bytes(meshes.bowl())
        subprocess.run(["gcc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", self.folder / "strike.c",
                        "-o", self.folder / "strike", f"-I{self.prefix}/include", f"-L{self.library.parent}",
                        "-lcarillon", f"-Wl,-rpath,{self.library.parent}"], check=True)
        environment = {**os.environ, "CARILLON_SERVER": self.daemon.server}
        subprocess.run([self.folder / "strike", self.folder / "bowl.obj"], env=environment, check=True,
                       stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        with carillon.connect(self.daemon.server) as c, c.recording() as heard:
            with subprocess.Popen([self.folder / "strike", self.folder / "bowl.obj"], env=environment,
                                  stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as striker:
                heard.take(2.0)
                said = striker.communicate("\n")[0]
            self.assertEqual((striker.returncode, said), (0, "strikes in time: 1\n"))
            self.assertGreater(heard.sound.peak, 1e-4)
        failed = subprocess.run([self.folder / "strike", "none.obj"], env=environment, check=False,
                                stdin=subprocess.DEVNULL, capture_output=True, text=True)
        self.assertEqual(failed.returncode, 1)
        self.assertIn("strike: FILE_NOT_FOUND: none.obj", failed.stderr)

    def test_what_is_probably_wrong_with_contacts_is_told(self):
        scene, stream, handle, report = ctypes.c_void_p(), ctypes.c_void_p(), ctypes.c_uint32(), Report()
        code, model = self.model_of_arrays(VERTICES, TRIANGLES)
        self.assertEqual(code, 0)
        self.assertEqual(self.c.carillon_create_scene(self.connection, None, ctypes.byref(scene)), 0)
        self.addCleanup(self.c.carillon_delete_scene, scene)
        bar = Object(model.encode(), meshes.MATERIAL.encode())
        self.assertEqual(self.c.carillon_add_object(scene, ctypes.byref(bar), ctypes.byref(handle)), 0)

        def warnings_of(*impacts):
            self.assertEqual(self.c.carillon_open_stream(scene, 1 / 60, 0, ctypes.byref(stream)), 0)
            rows = (Contact * len(impacts))(*impacts)
            step = Step(contacts=rows, contact_count=len(rows))
            self.assertEqual(self.c.carillon_send(stream, ctypes.byref(step)), 0)
            for name in ("contact_count", "pose_count"):
                empty = Step(**{name: 3})
                self.assertEqual(self.c.carillon_send(stream, ctypes.byref(empty)), 3)
                self.assertRegex(self.c.carillon_error(), b"^INVALID_SETTINGS: an array of the step is a null pointer")
            self.assertEqual(self.c.carillon_close_stream(stream, ctypes.byref(report)), 0)
            return self.c.carillon_warnings().decode().splitlines()

        point, blow = Vec3(0.1, 0.015, 0.01), Vec3(0, 0, -1e-3)
        self.assertEqual(warnings_of(impact(handle, point, blow)), [])
        far, lost = warnings_of(impact(99, point, blow), impact(handle, Vec3(100, 15, 10), blow))[::-1]
        self.assertRegex(far, "^POINTS_DISTANT: ")
        self.assertRegex(lost, "^CONTACTS_REJECTED: .* OBJECT_NOT_FOUND: ")
        for wrong in (Contact(3, handle, point, blow), Contact(IMPACT, handle, point, Vec3(), blow),
                      Contact(0, handle, point, blow, blow), Contact(FORCE, handle, point, blow)):
            self.assertEqual(self.c.carillon_open_stream(scene, 1 / 60, 0, ctypes.byref(stream)), 0)
            self.assertEqual(self.c.carillon_send(stream, ctypes.byref(Step(contacts=ctypes.pointer(wrong),
                                                                            contact_count=1))), 3)
            self.assertRegex(self.c.carillon_error(), b"^INVALID_SETTINGS: .* contact")
            self.assertEqual(self.c.carillon_close_stream(stream, None), 0)
        for step_s in (0, -1, 10, float("nan")):
            self.assertEqual(self.c.carillon_create_trace(b"x.contacts", step_s, 0, None, ctypes.byref(stream)), 3)
            self.assertRegex(self.c.carillon_error(), b"^INVALID_STREAM: step_s is .* from 1e-6 to 1 s")

    def test_what_the_daemon_cannot_read_is_refused_with_a_reason(self):
        scene, stream, trace, sound = ctypes.c_void_p(), ctypes.c_void_p(), ctypes.c_void_p(), Sound()
        self.assertEqual(self.c.carillon_create_scene(self.connection, None, ctypes.byref(scene)), 0)
        self.addCleanup(self.c.carillon_delete_scene, scene)
        lasting = ctypes.c_void_p()
        registration = Registration(b"large", None, None, 0)
        self.assertEqual(self.c.carillon_register_scene(self.connection, ctypes.byref(registration),
                                                        ctypes.byref(lasting)), 0)
        self.addCleanup(self.c.carillon_delete_scene, lasting)
        many = (Contact * 100_000)(*(impact(1, Vec3(1, 1, 1), Vec3(1, 1, 1)) for _ in range(100_000)))
        step = Step(contacts=many, contact_count=len(many))
        for struck in (scene, lasting):
            self.assertEqual(self.c.carillon_open_stream(struck, 1 / 60, 0, ctypes.byref(stream)), 0)
            self.assertEqual(self.c.carillon_send(stream, ctypes.byref(step)), 3)
            self.assertRegex(self.c.carillon_error(), b"^STEP_TOO_LARGE: a step of .* bytes: the daemon takes at most")
            # The stream goes on.
            self.assertEqual(self.c.carillon_send(stream, ctypes.byref(Step())), 0)
            self.assertEqual(self.c.carillon_close_stream(stream, None), 0)
        bar = Object(b"modalModels/\xff", meshes.MATERIAL.encode())
        self.assertEqual(self.c.carillon_add_object(scene, ctypes.byref(bar), None), 12)
        self.assertRegex(self.c.carillon_error(), b"^REQUEST_MALFORMED: .* text in UTF-8")
        file = str(self.folder / "empty.contacts").encode()
        self.assertEqual(self.c.carillon_create_trace(file, 1 / 60, 0, None, ctypes.byref(trace)), 0)
        self.assertEqual(self.c.carillon_close_trace(trace), 0)
        self.assertEqual(self.c.carillon_render(self.connection, file, None, ctypes.byref(sound)), 3)
        self.assertRegex(self.c.carillon_error(), b"^TRACE_EMPTY: ")

    def test_only_functions_of_the_header_are_exported(self):
        listed = subprocess.run(["nm", "-D", "--defined-only", self.library], check=True, capture_output=True,
                                text=True).stdout
        exported = {line.split()[-1] for line in listed.splitlines()}
        header = (self.prefix / "include/carillon.h").read_text()
        declared = set(re.findall(r"^(?:carillon_code|void|const char\*) (carillon_\w+)\(", header, re.MULTILINE))
        self.assertEqual(exported, declared)

    def write_trace(self, file, steps, frame=0, hearing=None):
        """A trace of a bar. `steps` makes them for its handle. Returns the name of the bar's model."""
        code, model = self.model_of_arrays(VERTICES, TRIANGLES)
        self.assertEqual(code, 0, self.c.carillon_error())
        trace = ctypes.c_void_p()
        code = self.c.carillon_create_trace(file.encode(), 1 / 60, frame, hearing, ctypes.byref(trace))
        self.assertEqual(code, 0, self.c.carillon_error())
        handle = ctypes.c_uint32()
        bar = Object(model=model.encode(), material=meshes.MATERIAL.encode())
        self.assertEqual(self.c.carillon_trace_object(trace, ctypes.byref(bar), ctypes.byref(handle)), 0)
        for step in steps(handle):
            self.assertEqual(self.c.carillon_trace_step(trace, ctypes.byref(step)), 0)
        self.assertEqual(self.c.carillon_close_trace(trace), 0)
        return model

    def render(self, file, channel_count=1):
        sound = Sound()
        settings = RenderSettings(44100, channel_count, 0.5)
        code = self.c.carillon_render(self.connection, file.encode(), ctypes.byref(settings), ctypes.byref(sound))
        self.assertEqual(code, 0, self.c.carillon_error())
        samples = numpy.ctypeslib.as_array(sound.samples, (sound.frame_count, sound.channel_count)).copy()
        self.c.carillon_free_sound(ctypes.byref(sound))
        return samples

    def test_a_trace_renders_to_the_samples_that_python_gets(self):
        def steps(handle):
            blow = impact(handle, Vec3(0.2, 0.015, 0.01), Vec3(0, 0, -0.01), 1e-4)
            return [Step(0.0, ctypes.pointer(blow), 1)]

        file = str(self.folder / "c.contacts")
        model = self.write_trace(file, steps)
        samples = self.render(file)
        with carillon.connect(self.daemon.server) as c:
            same = c.render(file, sample_rate_hz=44100, tail_s=0.5)
            # Equal arrays are one model, from whichever language they come.
            self.assertEqual(c.create_model((VERTICES, TRIANGLES), meshes.MATERIAL).name, model)
        self.assertGreater(same.peak, 1e-5)
        numpy.testing.assert_array_equal(samples, same.samples)

    def test_a_trace_in_slow_motion_and_with_a_pause_renders_to_the_samples_that_python_gets(self):
        scales = (0, 0.25, -1, 4)

        def steps(handle):
            blow = impact(handle, Vec3(0.2, 0.015, 0.01), Vec3(0, 0, -0.01), 1e-4)
            return [Step(0.125 * i, ctypes.pointer(blow), 1, time_scale=scale) for i, scale in enumerate(scales)]

        file = str(self.folder / "slow.contacts")
        model = self.write_trace(file, steps)
        trace = carillon.Trace(1 / 60)
        handle = trace.add(model, meshes.MATERIAL)
        for i, scale in enumerate((None, 0.25, 0, 4)):
            trace.step(0.125 * i, impacts=carillon.Impacts(handle, (0.2, 0.015, 0.01), (0, 0, -0.01), durations=1e-4),
                       time_scale=scale)
        samples = self.render(file)
        with carillon.connect(self.daemon.server) as c:
            same = c.render(trace, sample_rate_hz=44100, tail_s=0.5)
        # Columns have floats, and rows doubles.
        numpy.testing.assert_allclose(samples, same.samples, atol=1e-4 * same.peak)
        self.assertAlmostEqual(len(samples) / 44100, 0.5 + 1 / 60 + 0.125 / 4 + 0.5, delta=0.005)

    def assert_keeps_time(self, send):
        for time_s, code in ((1.0, 0), (float("nan"), 3), (1.1e10, 3), (0.5, 3), (2.0, 0)):
            self.assertEqual(send(ctypes.byref(Step(time_s))), code)
            if code:
                refused = self.c.carillon_error()
                self.assertRegex(refused, b"^INVALID_STREAM: .*(goes back .* at step 1|step 1 is (nan|1.1e\\+10)); ")

    def test_a_step_whose_time_is_too_large_or_goes_back_is_refused_at_once(self):
        file, trace = str(self.folder / "back.contacts"), ctypes.c_void_p()
        self.assertEqual(self.c.carillon_create_trace(file.encode(), 1 / 60, 0, None, ctypes.byref(trace)), 0)
        self.assert_keeps_time(lambda step: self.c.carillon_trace_step(trace, step))
        self.assertEqual(self.c.carillon_close_trace(trace), 0)
        self.assertEqual([step.time_s for step in carillon.Trace.read(file).steps], [1, 2])
        scene, stream, report = ctypes.c_void_p(), ctypes.c_void_p(), Report()
        self.assertEqual(self.c.carillon_create_scene(self.connection, None, ctypes.byref(scene)), 0)
        self.addCleanup(self.c.carillon_delete_scene, scene)
        self.assertEqual(self.c.carillon_open_stream(scene, 1 / 60, 0, ctypes.byref(stream)), 0)
        self.assert_keeps_time(lambda step: self.c.carillon_send(stream, step))
        self.assertEqual(self.c.carillon_close_stream(stream, ctypes.byref(report)), 0)
        self.assertEqual(report.step_count, 2)

    def test_a_placed_bar_is_heard_from_its_place(self):
        """The bar is 2 m to the right of the listener, who looks along -z from z = 1 m."""
        at = Vec3(2, 0, 1)

        def blow(handle, point, listener=None):
            pose, struck = Pose(handle, at), impact(handle, point, Vec3(0, 0, -0.01), 1e-4)
            return [Step(0.0, ctypes.pointer(struck), 1, ctypes.pointer(pose), 1,
                         listener and ctypes.pointer(listener))]

        hearing = Hearing(distance_gain=1, propagation_delay=1, panning=1, listener=Pose(0, Vec3(0, 0, 1)))
        here, file = Vec3(0.2, 0.015, 0.01), str(self.folder / "placed.contacts")
        self.write_trace(file, lambda handle: blow(handle, here), 0, ctypes.byref(hearing))
        left, right = self.render(file, 2).T
        self.assertGreater(abs(right).max(), 1e-5)
        self.assertLess(abs(left).max(), 1e-3 * abs(right).max())
        # The same point in the frame of the scene gives the same sound.
        self.write_trace(file, lambda handle: blow(handle, Vec3(here.x + at.x, here.y + at.y, here.z + at.z)), 1,
                         ctypes.byref(hearing))
        again = self.render(file, 2)[:, 1]
        numpy.testing.assert_allclose(again, right, atol=1e-3 * abs(right).max())
        # A listener who has turned round hears it from the left.
        turned = Pose(0, Vec3(0, 0, 1), Quaternion(0, 0, 1, 0))
        self.write_trace(file, lambda handle: blow(handle, here, turned), 0, ctypes.byref(hearing))
        numpy.testing.assert_allclose(self.render(file, 2)[:, 0], right, atol=1e-3 * abs(right).max())
        # Without a hearing the bar sounds at 1 m, at once, and on both channels.
        self.write_trace(file, lambda handle: blow(handle, here))
        plain = self.render(file, 2)
        numpy.testing.assert_array_equal(*plain.T)
        delay = int(2 / 343 * 44100)
        first = [numpy.flatnonzero(abs(sound) > 0.05 * abs(sound).max())[0] for sound in (plain[:, 0], right)]
        self.assertAlmostEqual(first[1] - first[0], delay, delta=20)

    def test_hearings_and_frames_that_are_none_are_refused(self):
        made, hearing = ctypes.c_void_p(), Hearing(near_field=1)
        refused = self.c.carillon_create_scene(self.connection, ctypes.byref(hearing), ctypes.byref(made))
        self.assertEqual((refused, self.c.carillon_error_reason()), (3, b"INVALID_SETTINGS"))
        refused = self.c.carillon_create_trace(str(self.folder / "x").encode(), 0.01, 7, None, ctypes.byref(made))
        self.assertEqual(refused, 3)
        self.assertIn(b"the frame is 7", self.c.carillon_error())

    def test_a_registered_scene_outlives_its_daemon(self):
        code, model = self.model_of_arrays(VERTICES, TRIANGLES)
        self.assertEqual(code, 0, self.c.carillon_error())
        bars = (Object * 2)(*(Object(model.encode(), meshes.MATERIAL.encode(), handle=handle) for handle in (5, 9)))
        registration = Registration(b"lathe-1", None, bars, 2)
        scene, again, stream = ctypes.c_void_p(), ctypes.c_void_p(), ctypes.c_void_p()
        for made in (scene, again):
            code = self.c.carillon_register_scene(self.connection, ctypes.byref(registration), ctypes.byref(made))
            self.assertEqual(code, 0, self.c.carillon_error())
            self.assertEqual(self.c.carillon_scene_name(made), b"scenes/lathe-1")
        self.assertEqual(self.c.carillon_open_stream(scene, 0.01, 0, ctypes.byref(stream)), 0)
        self.daemon.kill()
        self.daemon.start()
        step = Step(0.0)
        handles, end_s = [], time.monotonic() + 30
        with carillon.connect(self.daemon.server) as c:
            while handles != [5, 9] and time.monotonic() < end_s:
                step.time_s += 0.01
                self.assertEqual(self.c.carillon_send(stream, ctypes.byref(step)), 0, self.c.carillon_error())
                time.sleep(0.01)
                handles = [item.handle for scene_there in c.scenes() for item in scene_there.objects()]
        self.assertEqual(handles, [5, 9])
        blow = impact(9, Vec3(0.2, 0.015, 0.01), Vec3(0, 0, -0.01), 1e-4)
        step.contacts, step.contact_count, step.time_s = ctypes.pointer(blow), 1, step.time_s + 0.01
        report = Report()
        while report.accepted_count + report.late_count == 0 and time.monotonic() < end_s:
            self.assertEqual(self.c.carillon_send(stream, ctypes.byref(step)), 0)
            self.assertEqual(self.c.carillon_close_stream(stream, ctypes.byref(report)), 0, self.c.carillon_error())
            self.assertEqual(self.c.carillon_open_stream(scene, 0.01, 0, ctypes.byref(stream)), 0)
        self.assertEqual(report.accepted_count + report.late_count, 1)
        self.c.carillon_close_stream(stream, None)
        self.c.carillon_delete_scene(again)
        self.c.carillon_delete_scene(scene)


if __name__ == "__main__":
    unittest.main()
