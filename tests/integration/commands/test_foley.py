# SPDX-License-Identifier: Apache-2.0
"""`carillon foley`: a bar that falls flat on a floor and bounces once is heard when it lands, from a table of poses and
from a glTF; what is no motion, or not explained by contacts, is refused by name."""

import json
import re
import signal
import subprocess

import numpy

import carillon
import gltf
import meshes
import scripted
import sound
from carillon.v1 import decomposition_pb2, decomposition_service_pb2
from daemon import BIN, DaemonTest, ScratchTest, wait_until

GRAVITY, HEIGHT_M, RESTITUTION, RATE_HZ = 9.81, 0.2, 0.6, 60
SIDES_M = (0.2, 0.02, 0.01)
MASS_KG = 7850 * 0.2 * 0.02 * 0.01  # of structural_steel
FIRST_S = 0.0071
LANDS_S = FIRST_S + (2 * HEIGHT_M / GRAVITY) ** 0.5
SPEED_M_PER_S = (2 * GRAVITY * HEIGHT_M) ** 0.5
IMPULSE_N_S = MASS_KG * SPEED_M_PER_S * (1 + RESTITUTION)


def heights():
    """Times of the frames, and the height of the bar's centre."""
    times = numpy.arange(0, LANDS_S + 0.2, 1 / RATE_HZ)
    before, after = times - FIRST_S, times - LANDS_S
    height = numpy.where(after < 0, HEIGHT_M - GRAVITY * before**2 / 2,
                         RESTITUTION * SPEED_M_PER_S * after - GRAVITY * after**2 / 2)
    return times, height + SIDES_M[2] / 2


def write_gltf(path, *, keys=slice(None), skin=False, mass=None, material="Structural Steel", drawn=SIDES_M,
               collider=None, scale=(1, 1, 1), interpolation="LINEAR", flips=False, later_s=0,
               inward=False, heading=0, ground=(4, 0.2, 4), ground_material="Ground"):
    """The same fall with y up: a bar in a turned parent, a floor, and a camera that looks along -z. With `flips` the
    quaternion of the bar, which does not turn, changes its sign at each key. `heading` is about the vertical, rad."""
    writer = gltf.Writer()

    def mesh(sides, named):
        vertices, triangles = map(numpy.array, meshes.centred_box(sides))
        corners = vertices[triangles.ravel()]  # a corner for each triangle, as exporters write them
        corners = corners[::-1] if inward else corners
        return {"primitives": [{"attributes": {"POSITION": writer.add(corners)}, "material": named}]}

    times, height = heights()
    half = 0.5**0.5
    c, s = half * numpy.cos(heading / 2), half * numpy.sin(heading / 2)

    def animation(path, values):
        values = numpy.array(values, float)[keys]
        if interpolation == "CUBICSPLINE":  # a tangent before and after each value
            values = numpy.stack([0 * values, values, 0 * values], 1).reshape(-1, values.shape[1])
        return {"samplers": [{"input": writer.add(times[keys] + later_s), "interpolation": interpolation,
                              "output": writer.add(values)}],
                "channels": [{"sampler": 0, "target": {"node": 1, "path": path}}]}

    bar = {"name": "Bar", "mesh": 0, "translation": [0, 0, 0], "scale": list(scale)}
    if skin:
        bar["skin"] = 0
    if mass:
        bar["extensions"] = {"KHR_physics_rigid_bodies": {"motion": {"mass": mass}}}
    if collider:
        bar["extensions"]["KHR_physics_rigid_bodies"]["collider"] = {"geometry": {"mesh": 2},
                                                                     "extras": {"rounding": collider[1]}}
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 2, 3]}],
        "materials": [{"name": material}, {"name": ground_material}],
        "meshes": [mesh(drawn / numpy.abs(scale), 0), mesh(ground, 1)],
        # The bar's own z, along which it falls, is the scene's y.
        "nodes": [{"name": "Turned", "rotation": [-c, s, s, c], "translation": [heading, 0, 0], "children": [1]},
                  bar,
                  {"name": "Ground", "mesh": 1, "translation": [0, -ground[1] / 2, 0]},
                  {"name": "Camera", "camera": 0, "translation": [0, 0.3, 1]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
        "animations": [animation("translation", [(0, 0, z) for z in height])]
        + [animation("rotation", [(0, 0, 0, (-1) ** k) for k in range(len(times))])] * flips,
        "bufferViews": writer.views, "accessors": writer.accessors}
    if collider:
        document["meshes"].append(mesh(collider[0], 0))
    if skin:
        document["skins"] = [{"joints": [2]}]
    gltf.write_binary(path, document, writer.buffer)


def impacts(path):
    """Times, and impulses in the scene's vertical, of the impacts of a trace."""
    trace = carillon.Trace.read(path)
    return [(step.time_s + row.time_offset_s, row.impulse_newton_seconds.z)
            for step in trace.steps for row in step.contacts if row.kind == 2]


def write_box(path, sides=SIDES_M, faces=slice(None)):
    vertices, triangles = meshes.centred_box(sides)
    path.write_bytes(meshes.obj(vertices, triangles[faces]))


def rows_of_poses():
    return [(f"{t:.9g}", "Bar", 0, 0, f"{z:.9g}", 1, 0, 0, 0) for t, z in zip(*heights())]


def write_poses(path, rows, columns="t,body,x,y,z,qw,qx,qy,qz", separator=",", start="", end="\n"):
    lines = [*([columns] if columns else []), *(",".join(map(str, row)) for row in rows)]
    path.write_bytes((start + "".join(line.replace(",", separator) + end for line in lines)).encode())


class FoleyTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.write_box("bar.obj")
        times, height = heights()
        cls.rows = rows_of_poses()
        cls.write_poses("fall.csv", cls.rows)
        count = len(times)
        numpy.savez(cls.folder / "fall.npz", times=times, bodies=numpy.array(["Bar"]),
                    positions=numpy.stack([numpy.zeros(count), numpy.zeros(count), height], 1)[:, None],
                    orientations=numpy.tile([1.0, 0, 0, 0], (count, 1, 1)))
        write_gltf(cls.folder / "fall.glb")

    @classmethod
    def write_box(cls, name, *form, **named):
        write_box(cls.folder / name, *form, **named)

    @classmethod
    def write_poses(cls, name, *form, **named):
        write_poses(cls.folder / name, *form, **named)

    def foley(self, file, *words, check=True):
        return self.daemon.command("foley", self.folder / file, *words, check=check)

    def table(self, file, *words, mesh="bar.obj", check=True):
        return self.foley(file, "--mesh", f"Bar={self.folder / mesh}", "--material", "Bar=structural_steel", *words,
                          check=check)

    def check_impacts(self, path, impulse=IMPULSE_N_S):
        found = impacts(path)
        self.assertGreater(len(found), 0)
        for time, _ in found:
            self.assertAlmostEqual(time, LANDS_S, delta=5e-5)
        self.assertAlmostEqual(sum(z for _, z in found), impulse, delta=1e-3 * impulse)

    def test_a_table_and_an_archive_give_the_impact_of_the_landing(self):
        # The floor has no end.
        self.write_poses("far.csv", [[time, body, x + 60, *rest] for time, body, x, *rest in self.rows])
        for file in ("fall.csv", "fall.npz", "far.csv"):
            trace = self.folder / f"{file}.contacts"
            done = self.table(file, "--floor", 0, "--trace", trace)
            self.assertIn("unexplained", done.stderr)
            self.check_impacts(trace)

    def test_a_gltf_is_heard_when_it_lands_and_stems_add_up(self):
        trace, wav, stems = (self.folder / name for name in ("glb.contacts", "glb.wav", "stems"))
        self.foley("fall.glb", "--out", wav, "--trace", trace, "--stems", stems, "--channels", 2, "--tail", 1)
        self.check_impacts(trace)
        samples = sound.read_wave(wav)
        loud = numpy.abs(samples).max(axis=-1)
        first = numpy.argmax(loud > 0.05 * loud.max()) / sound.RATE
        # The picture is heard without the delay of the air; the sound rises within a millisecond.
        self.assertAlmostEqual(first, LANDS_S, delta=0.001)
        numpy.testing.assert_array_equal(sound.read_wave(stems / "1-Bar.wav"), samples)

    def test_wait_computes_the_radiation_before_the_sound(self):
        def heard(command, name, *words):
            out = self.folder / f"{name}.wav"
            told = json.loads(self.daemon.command("--json", command, self.folder / name, "--out", out, "--tail", 1,
                                                  *words).stdout)
            return sound.read_wave(out), int(told["paper_coupling_object_count"])

        self.assertEqual(heard("foley", "fall.glb")[1], 1)
        waited, count = heard("foley", "fall.glb", "--wait")
        self.assertEqual(count, 0)
        numpy.testing.assert_array_equal(heard("foley", "fall.glb")[0], waited)
        self.foley("fall.glb", "--material", "Bar=brass", "--trace", self.folder / "brass.contacts")
        self.assertEqual(heard("render", "brass.contacts")[1], 1)
        self.assertEqual(heard("render", "brass.contacts", "--wait")[1], 0)

    def test_a_mesh_has_one_model_however_it_lies(self):
        def model(heading):
            write_gltf(self.folder / "lies.glb", scale=(0.1, 2, 0.5), heading=heading)
            self.foley("lies.glb", "--trace", self.folder / "lies.contacts")
            self.check_impacts(self.folder / "lies.contacts")
            return carillon.Trace.read(self.folder / "lies.contacts").objects[0].modal_model

        self.assertEqual(len({model(heading) for heading in (0, 0.3, 0.7, 1.1, 1.9)}), 1)

    def test_scaled_and_mirrored_nodes_and_each_interpolation_give_the_same_impact(self):
        for name, form in {"scaled": {"scale": (0.1, 2, 0.5)}, "mirrored": {"scale": (1, -1, 1)},
                           "step": {"interpolation": "STEP"}, "spline": {"interpolation": "CUBICSPLINE"},
                           "flips": {"flips": True}, "flipped_spline": {"interpolation": "CUBICSPLINE", "flips": True}
                           }.items():
            with self.subTest(name):
                write_gltf(self.folder / f"{name}.glb", **form)
                trace = self.folder / f"{name}.contacts"
                self.foley(f"{name}.glb", "--trace", trace)
                self.check_impacts(trace)

    def test_a_table_has_its_columns_in_any_order_and_any_unit(self):
        rows, trace = self.rows, self.folder / "columns.contacts"
        last = [(k, name, qx, qy, qz, qw, x, y, z, t) for k, (t, name, x, y, z, qw, qx, qy, qz) in enumerate(rows)]
        self.write_poses("last.csv", last, "Frame,Body,QX,QY,QZ,QW,X,Y,Z,T", "; ", "\ufeff", "\r\n")
        self.table("last.csv", "--floor", 0, "--trace", trace)
        self.check_impacts(trace)
        self.write_poses("bare.csv", rows, columns="", separator="\t")
        self.table("bare.csv", "--floor", 0, "--trace", trace)
        self.check_impacts(trace)
        milli = [(t, name, x, y, float(z) * 1000, *q) for t, name, x, y, z, *q in rows]
        self.write_poses("milli.csv", milli)
        self.write_box("milli.obj", [1000 * side for side in SIDES_M])
        self.table("milli.csv", "--unit", "mm", "--floor", 0, "--trace", trace, mesh="milli.obj")
        self.check_impacts(trace)

    def test_a_table_with_gaps_is_refused_with_its_line(self):
        out = ("--trace", self.folder / "none.contacts")
        rows = [(k / 60, name, 0, 0, 1, 1, 0, 0, 0) for k in range(10) for name in ("Bar", "Rod")]
        empty, nan = (0.05, "Bar", "", "", "", 1, 0, 0, 0), (0.05, "Bar", "NaN", 0, 1, 1, 0, 0, 0)
        for name, instead, words in (("gap", [], "Bar has no pose at 0.05 s, when line 8 "),
                                     ("empty", [empty], "line 8 "), ("nan", [nan], "line 8 "),
                                     ("twice", [rows[6]] * 2, "line 9 ")):
            wrong = [*rows[:6], *instead, *rows[7:]]
            with self.subTest(name):
                self.write_poses(f"{name}.csv", wrong)
                self.refused("MOTION_MALFORMED", self.table(f"{name}.csv", *out, check=False), words)
        self.write_poses("names.csv", rows, "time,body,x,y,z,qw,qx,qy,qz")
        self.refused("MOTION_MALFORMED", self.table("names.csv", *out, check=False), "the column t ")
        arrays = dict(numpy.load(self.folder / "fall.npz"))
        numpy.savez(self.folder / "by_body.npz", **{**arrays, "positions": arrays["positions"].swapaxes(0, 1)})
        self.refused("MOTION_MALFORMED", self.table("by_body.npz", *out, check=False), "positions must be ")
        numpy.savez(self.folder / "objects.npz", **{**arrays, "times": arrays["times"].astype(object)})
        self.refused("MOTION_MALFORMED", self.table("objects.npz", *out, check=False), "times")

    def test_a_mass_of_the_file_scales_the_impulse(self):
        write_gltf(self.folder / "heavy.glb", mass=2 * MASS_KG)
        trace = self.folder / "heavy.contacts"
        self.foley("heavy.glb", "--trace", trace)
        self.check_impacts(trace, 2 * IMPULSE_N_S)
        self.foley("heavy.glb", "--trace", trace, "--material-masses")
        self.check_impacts(trace)

    def test_normals_that_point_inward_change_neither_masses_nor_impulses(self):
        trace = self.folder / "inward.contacts"
        write_gltf(self.folder / "inward.glb", inward=True)
        self.foley("inward.glb", "--trace", trace)
        self.check_impacts(trace)
        write_gltf(self.folder / "inward.glb", inward=True, mass=2 * MASS_KG)
        self.foley("inward.glb", "--trace", trace, "--material-masses")
        self.check_impacts(trace)

    def test_a_collider_that_the_simulator_rounds_touches_in_place_of_the_mesh(self):
        # What is seen is smaller than what touches, by the same 2 mm on all sides.
        write_gltf(self.folder / "round.glb", drawn=tuple(side - 0.004 for side in SIDES_M), mass=MASS_KG,
                   collider=(tuple(side - 0.006 for side in SIDES_M), 0.003))
        trace = self.folder / "round.contacts"
        self.foley("round.glb", "--trace", trace)
        self.check_impacts(trace)

    def test_an_open_surface_is_repaired_where_it_is_asked_for(self):
        self.write_box("open.obj", faces=slice(1, None))
        out = self.folder / "hole.wav"
        self.refused("SURFACE_OPEN", self.table("fall.csv", "--floor", 0, "--out", out, mesh="open.obj", check=False))
        self.table("fall.csv", "--floor", 0, "--repair", "B*", "--out", out, "--tail", 0.1, mesh="open.obj")
        self.assertGreater(numpy.abs(sound.read_wave(out)).max(), 1e-4)

    def test_the_sound_begins_with_the_first_key(self):
        write_gltf(self.folder / "later.glb", later_s=1 / 24)  # as Blender exports frame 1
        sounds = [self.folder / f"{name}.wav" for name in ("fall", "later")]
        for out in sounds:
            self.foley(out.with_suffix(".glb").name, "--out", out, "--tail", 0.1)
        first, later = (sound.read_wave(out)[:, 0] for out in sounds)
        # The file's times have single precision, so that a blow is some microseconds apart.
        self.assertGreater(first @ later, 0.98 * numpy.linalg.norm(first) * numpy.linalg.norm(later))

    def test_stems_have_the_scale_of_a_normalized_sound(self):
        out = self.folder / "normal.wav"
        self.foley("fall.glb", "--out", out, "--stems", self.folder / "normal", "--tail", 0.1, "--normalize")
        whole, stem = sound.read_wave(out), sound.read_wave(self.folder / "normal" / "1-Bar.wav")
        self.assertAlmostEqual(numpy.abs(whole).max(), 0.9, delta=1e-3)
        numpy.testing.assert_allclose(stem, whole, atol=1e-4)

    def test_a_body_too_small_to_be_heard_stays_silent_beside_others(self):
        self.write_poses("two.csv", [(row[0], name, x, *row[3:]) for row in self.rows
                                     for name, x in (("Bar", 0), ("Die", 1))])
        self.write_box("die.obj", (0.012, 0.012, SIDES_M[2]))
        done = self.table("two.csv", "--floor", 0, "--mesh", f"Die={self.folder / 'die.obj'}", "--material",
                          "Die=structural_steel", "--trace", self.folder / "two.contacts")
        self.assertRegex(done.stderr, "(?m)^warning: Die: ")
        self.check_impacts(self.folder / "two.contacts")

    def test_what_never_moves_is_struck_in_silence_as_of_its_material_unless_it_is_named(self):
        path = self.folder / "scenery.contacts"

        def heard(file, *words):
            """The labels of the objects, the strikers of the bar's contacts, and what the command says."""
            done = self.foley(file, "--trace", path, *words)
            trace = carillon.Trace.read(path)
            strikers = {row.hertz.striker for step in trace.steps for row in step.contacts if row.HasField("hertz")}
            return [item.label for item in trace.objects], strikers, done.stderr

        write_gltf(self.folder / "scenery.glb", ground=(0.22, 0.05, 0.05), ground_material="Concrete")
        for words in ((), ("--material", "G*=concrete")):
            labels, strikers, told = heard("scenery.glb", *words)
            self.assertEqual((labels, strikers), (["Bar"], {"concrete"}))
            self.check_impacts(path)
            self.assertRegex(told, "(?m)^warning: Ground never moves")
        labels, strikers, told = heard("scenery.glb", "--material", "Ground=brass")
        self.assertCountEqual(labels, ["Bar", "Ground"])
        self.assertNotIn("warning", told)
        self.assertRegex(self.foley("scenery.glb", "--list").stdout, r"Ground +fixed +silent \(concrete\)")
        # An endless floor has no sound, whatever it is named.
        labels, strikers, told = heard("fall.csv", "--mesh", f"Bar={self.folder / 'bar.obj'}", "--floor", 0,
                                       "--material", "Bar=structural_steel", "--material", "floor=oak")
        self.assertEqual((labels, strikers), (["Bar"], {"oak"}))
        self.assertNotIn("warning", told)
        write_gltf(self.folder / "still.glb", material="none of these", ground_material="Concrete", mass=MASS_KG)
        self.refused("BODY_UNKNOWN", self.foley("still.glb", "--trace", path, check=False))

    def test_meshes_and_poses_in_two_units_are_named(self):
        def moved(name, factor):
            self.write_poses(name, [(t, body, x, y, float(z) * factor, *q) for t, body, x, y, z, *q in self.rows])
            return name

        out = ("--floor", 0, "--trace", self.folder / "units.contacts")
        centi, milli = moved("centi.csv", 100), moved("milli_poses.csv", 1000)
        for factor in (0.01, 0.001, 100):
            self.write_box(f"{factor}.obj", [factor * side for side in SIDES_M])
        for file, words, unit, mesh in (
                (centi, (), "centimetres", "bar.obj"), (milli, (), "millimetres", "bar.obj"),
                ("fall.csv", ("--unit", "cm"), "metres", "100.obj"),
                ("fall.csv", ("--unit", "mm"), "metres", "bar.obj")):
            with self.subTest(file, words=words):
                done = self.table(file, *out, *words, mesh=mesh, check=False)
                self.refused("MOTION_UNIT_WRONG", done, f"poses are in {unit},")
        for factor, act in ((100, lambda: self.table("fall.csv", *out, mesh="0.01.obj", check=False)),
                            (1000, lambda: self.table("fall.csv", *out, mesh="0.001.obj", check=False)),
                            (0.01, lambda: self.table("fall.csv", *out, mesh="100.obj", check=False)),
                            (100, lambda: self.table(centi, *out, "--unit", "cm", check=False))):
            with self.subTest(factor):
                self.refused("MOTION_UNIT_WRONG", act(), f" {factor} times as large")
        done = self.table(centi, *out, "--force", check=False)
        self.assertRegex(done.stderr, "(?m)^warning: Bar falls at 981 m/s")

    def test_list_shows_bodies_and_cameras(self):
        lines = self.foley("fall.glb", "--list").stdout
        for pattern in (r"Bar +free +structural_steel +0\.314 kg +0\.2 x 0\.02 x 0\.01 m +12 triangles, closed",
                        r"Ground +fixed +silent", r"Camera +camera"):
            self.assertRegex(lines, pattern)

    def refused(self, reason, done, words=""):
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, f"carillon: {reason}: .*{words}")

    def test_refusals_have_names(self):
        out = ("--trace", self.folder / "none.contacts")
        self.refused("MOTION_WITHOUT_CONTACT", self.table("fall.csv", *out, check=False))
        flight = [(k / 60, k / 90, 2 + k / 20 - 4.905 * (k / 60)**2) for k in range(30)]
        self.write_poses("flight.csv", [(time, "Bar", x, 0, z, 1, 0, 0, 0) for time, x, z in flight])
        flight = self.table("flight.csv", "--floor", 0, *out, check=False)
        self.refused("MOTION_WITHOUT_CONTACT", flight)
        self.assertLess(float(re.search(r"unexplained (\S+) %", flight.stderr)[1]), 0.1)
        for floor_m in (-0.02, -0.1, -1):
            low = self.table("fall.csv", "--floor", floor_m, *out, check=False)
            self.refused("MOTION_WITHOUT_CONTACT", low, "floor")
        self.write_poses("still.csv", [(k / 60, "Bar", 0, 0, 1, 1, 0, 0, 0) for k in range(40)])
        self.refused("NO_MOTION", self.table("still.csv", "--floor", 0, *out, check=False), "no body moves")
        # By a hand that the file does not have.
        self.write_poses("pushed.csv", [(k / 60, "Bar", max(0, k - 20) * 0.05, 0, SIDES_M[2] / 2, 1, 0, 0, 0)
                                        for k in range(40)])
        self.refused("MOTION_UNEXPLAINED", self.table("pushed.csv", "--floor", 0, *out, check=False))
        self.refused("BODY_UNKNOWN", self.foley("fall.glb", "--material", "Cup=oak", *out, check=False))
        self.refused("BODY_UNKNOWN", self.foley("fall.csv", *out, check=False))
        for reason, form in (("MOTION_TOO_COARSE", {"keys": numpy.r_[0:10, 13, 14, 17:25]}),
                             ("NO_MOTION", {"keys": slice(0, 1)}), ("MOTION_MALFORMED", {"skin": True})):
            write_gltf(self.folder / "wrong.glb", **form)
            self.refused(reason, self.foley("wrong.glb", *out, check=False))
        (self.folder / "film.blend").write_bytes(b"BLENDER-v304REND" + bytes(100))
        self.refused("MOTION_MALFORMED", self.foley("film.blend", *out, check=False))
        self.write_box("small.obj", (0.012, 0.012, SIDES_M[2]))
        self.refused("NO_MODE_IN_BAND", self.table("fall.csv", "--floor", 0, *out, mesh="small.obj", check=False),
                     "Bar: ")
        self.assertFalse((self.folder / "none.contacts").exists())
        self.table("fall.csv", "--force", *out)
        self.assertEqual(impacts(self.folder / "none.contacts"), [])

    def python_contacts(self, stretch=1, **options):
        times, height = heights()
        times = times * stretch
        return carillon.motion.contacts(
            {"Bar": carillon.motion.Body(meshes.centred_box(SIDES_M), "structural_steel")}, times,
            {"Bar": ([(0, 0, z) for z in height], [(1, 0, 0, 0)] * len(times))},
            server=self.daemon.server, program=str(BIN / "carillon"), **options)

    def test_python_finds_the_same_contacts(self):
        found = self.python_contacts(floor=0)
        found.trace.write(self.folder / "python.contacts")
        self.check_impacts(self.folder / "python.contacts")
        self.assertLess(found.unexplained, 1e-6)
        without_friction = self.python_contacts(floor=0, friction=0)
        self.assertEqual(len(without_friction.trace.steps), len(found.trace.steps))
        self.assertLess(without_friction.unexplained, 1e-6)
        with self.assert_refused("MOTION_WITHOUT_CONTACT"):
            self.python_contacts()
        for bodies, poses in ((["Bar", "Rod"], ["Bar"]), (["Bar"], ["Bar", "Rod"])):
            with self.assertRaisesRegex(ValueError, "'Rod'"):
                carillon.motion.contacts({name: carillon.motion.Body("bar.obj") for name in bodies}, [0, 1],
                                         {name: ([(0, 0, 0)] * 2, [(1, 0, 0, 0)] * 2) for name in poses})
        with self.assertRaises(carillon.CarillonError) as refused:
            self.python_contacts(stretch=numpy.nan, floor=0)
        self.assertNotIn(".npz", refused.exception.message)


# A job lasts as long as the folder has the file "slow".
WORKER = """
while [ -e "$here/slow" ]; do printf '\\002\\012\\000' >&3; sleep 0.05; done
exec BIN/carillon-precompute "$@"
""".replace("BIN", str(BIN))


class StoppedTest(ScratchTest):
    def setUp(self):
        super().setUp()
        self.serve("--precompute", scripted.worker(self.folder, WORKER))
        write_box(self.folder / "bar.obj")
        write_poses(self.folder / "fall.csv", rows_of_poses())
        self.fall = ("foley", self.folder / "fall.csv", "--mesh", f"Bar={self.folder / 'bar.obj'}", "--floor", 0,
                     "--material", "Bar=structural_steel")

    def start(self, *words):
        """A command that awaits the job of the bar."""
        process = subprocess.Popen(
            [BIN / "carillon", "--server", self.daemon.server, *map(str, words)], stderr=subprocess.PIPE, text=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
        self.addCleanup(process.communicate)
        self.addCleanup(process.kill)
        while not process.stderr.readline().startswith("Bar"):
            self.assertIsNone(process.poll())
        return process

    def stop(self, process, number):
        process.send_signal(number)
        self.assertEqual(process.wait(10), -number)

    def states(self):
        jobs = self.client.jobs.ListJobs(decomposition_service_pb2.ListJobsRequest()).jobs
        return [decomposition_pb2.JobState.Name(job.state).removeprefix("JOB_STATE_") for job in jobs]

    def test_a_job_ends_with_the_last_command_that_awaits_it(self):
        (self.folder / "slow").touch()
        one, other = (self.start(*self.fall, "--trace", self.folder / f"{k}.contacts") for k in range(2))
        self.stop(one, signal.SIGINT)
        self.assertEqual(self.states(), ["RUNNING"])
        self.stop(other, signal.SIGTERM)
        wait_until(lambda: self.states() == ["CANCELLED"])

    def test_transfers_that_a_rendering_awaits_end_with_it(self):
        (self.folder / "traces").mkdir()
        trace = self.folder / "traces" / "fall.contacts"
        self.daemon.command(*self.fall, "--trace", trace)
        (self.folder / "slow").touch()
        for what, out in ((trace, "fall.wav"), (trace.parent, "clips")):
            self.stop(self.start("render", what, "--out", self.folder / out, "--wait"), signal.SIGINT)
            wait_until(lambda: sorted(self.states()) == ["CANCELLED", "SUCCEEDED"])
