# SPDX-License-Identifier: Apache-2.0
"""The add-on for Blender, in Blender without a window: a simulation is baked bit for bit with each of its steps, is
heard when and as it must, stands in the sequencer, is marked when it is out of date, and what fails has a name."""

import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy

import gltf
import sound
from daemon import BIN, ROOT

STEPS_PER_S = 250
BAR = r"Bar \[1]"
# The first mode of a free bar, 22.373 / (2 pi) sqrt(E I / (rho A)) / l^2, of structural steel.
BAR_HZ = 22.373 / (2 * numpy.pi) * (210e9 / 7850 / 12) ** 0.5 * 0.015 / 0.3**2


def read_motion(path, name):
    """Positions (F, 3) of a node of a binary glTF, in single precision."""
    document, buffer = gltf.read(path)
    animation = document["animations"][0]
    node = next(i for i, node in enumerate(document["nodes"]) if node["name"] == name)
    channel = next(c for c in animation["channels"] if c["target"] == {"node": node, "path": "translation"})
    return gltf.array(document, buffer, animation["samplers"][channel["sampler"]]["output"])


class BlenderTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        scratch = cls.enterClassContext(tempfile.TemporaryDirectory(prefix="carillon-"))
        cls.folder = pathlib.Path(scratch)
        (cls.folder / "addons").mkdir()
        (cls.folder / "addons" / "carillon_blender").symlink_to(ROOT / "client_sdk" / "blender")
        environment = os.environ | {"PATH": f"{BIN}:/usr/bin:/bin", "HOME": scratch, "XDG_RUNTIME_DIR": scratch,
                                    "XDG_STATE_HOME": scratch}
        environment.pop("CARILLON_SERVER", None)  # so that each bake starts a daemon of its own
        done = subprocess.run(
            ["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python",
             ROOT / "tests" / "integration" / "clients" / "blender" / "bakes.py", "--", cls.folder / "addons",
             cls.folder], env=environment, capture_output=True, text=True)
        if done.returncode != 0:
            raise AssertionError(done.stdout + done.stderr)
        cls.found = json.loads((cls.folder / "bakes.json").read_text())

    def test_each_step_of_the_simulation_is_a_frame_bit_for_bit(self):
        self.assertEqual(self.found["fall"]["result"], ["FINISHED"], self.found["fall"])
        self.assertIn("bit for bit", self.found["fall"]["report"])
        self.assertTrue(self.found["unchanged"])
        seen = numpy.array(self.found["seen"], numpy.float32)[:, :3, 3]
        baked = read_motion(self.folder / "carillon" / "fäll of a bar-Scene" / "motion.glb", BAR)
        self.assertEqual(len(baked), 10 * (len(seen) - 1) + 1)
        numpy.testing.assert_array_equal(baked[::10], seen[:, [0, 2, 1]] * numpy.float32([1, 1, -1]))

    def test_contacts_explain_the_motion_of_a_body_with_an_uneven_scale(self):
        # Without the simulator's own moments of inertia and its rounded corners this is 80 %.
        unexplained = float(self.found["fall"]["report"].split("unexplained ")[1].split()[0])
        self.assertLess(unexplained, 0.3)

    def onset_s(self, samples):
        loud = numpy.abs(samples)
        return numpy.argmax(loud > 0.05 * loud[:sound.RATE // 3].max()) / sound.RATE

    def test_the_sound_begins_with_the_impact_at_the_pitch_and_level_of_the_bar(self):
        folder = self.folder / "carillon" / "fäll of a bar-Scene"
        heights = read_motion(folder / "motion.glb", BAR)[:, 1].astype(float)
        jumps = numpy.diff(heights, 2) * STEPS_PER_S + 9.81 / STEPS_PER_S
        impact_s = (1 + numpy.argmax(jumps > 0.3)) / STEPS_PER_S
        samples = sound.read_wave(folder / "sound.wav").sum(axis=-1) / 2
        self.assertAlmostEqual(self.onset_s(samples), impact_s, delta=0.001)
        ringing = samples[int((impact_s + 0.05) * sound.RATE):]
        spectrum = numpy.abs(numpy.fft.rfft(ringing * numpy.hanning(len(ringing))))
        loudest_hz = numpy.argmax(spectrum[:int(1.5 * BAR_HZ * len(ringing) / sound.RATE)]) / len(ringing) * sound.RATE
        self.assertAlmostEqual(loudest_hz / BAR_HZ, 1, delta=0.02)
        # A kilogram of steel that falls 30 cm, heard from 1 m, is loud: full scale is 140 dB.
        peak_db = 20 * numpy.log10(numpy.abs(samples).max())
        self.assertTrue(-45 < peak_db < -6, peak_db)

    def test_the_sequencer_has_the_sound_and_its_stems(self):
        whole, stem = sorted(self.found["strips"], key=lambda strip: strip["channel"])
        self.assertEqual((whole["name"], whole["start"], whole["mute"]), ("Carillon", 5, False))
        self.assertEqual((stem["name"], stem["start"], stem["mute"]), ("Carillon Bar _[1]", 5, True))
        samples = sound.read_wave(pathlib.Path(whole["path"]))
        self.assertEqual(samples.shape, (26 * sound.RATE // 25, 2))
        self.assertEqual((whole["frames"], stem["frames"]), (26, 26))
        numpy.testing.assert_allclose(sound.read_wave(pathlib.Path(stem["path"])), samples, atol=1e-5)

    def test_a_change_marks_the_sound_as_out_of_date(self):
        self.assertEqual(self.found["marks"], {
            "baked": False, "another frame": False, "material": True, "material again": False, "place": True,
            "friction": True, "shape": True, "all again": False})

    def test_what_fails_has_a_name_and_leaves_the_strip(self):
        for case, reason, body in (("material", "UNKNOWN_MATERIAL", BAR), ("time", "TIME_REMAPPED", None),
                                   ("programs", "CARILLON_MISSING", None), ("open", "SURFACE_OPEN", BAR),
                                   ("no material", "NO_MATERIAL", None),
                                   ("negative scale", "SCALE_NEGATIVE", BAR),
                                   ("shape keys", "BODY_DEFORMS", BAR)):
            refused = self.found["refused"][case]
            self.assertEqual(refused["result"], ["CANCELLED"], case)
            self.assertTrue(refused["fault"].startswith(reason + ": "), refused)
            self.assertEqual(list(refused["faults"]), [body] if body else [], case)
        self.assertNotIn("Letter", self.found["refused"]["no material"]["fault"])
        self.assertRegex(self.found["refused"]["no mesh"]["fault"], "^NO_MATERIAL: Letter: ")
        self.assertRegex(self.found["usual"]["report"], "(?m)^warning: Letter: ")
        self.assertEqual(self.found["strips after refusals"], self.found["strips"])
        self.assertTrue(self.found["still"]["fault"].startswith("NO_MOTION: "), self.found["still"])

    def test_bodies_with_usual_settings_are_explained_and_small_ones_stay_silent(self):
        report = self.found["usual"]["report"]
        self.assertEqual(self.found["usual"]["result"], ["FINISHED"], self.found["usual"])
        self.assertLess(float(report.split("unexplained ")[1].split()[0]), 0.1)
        self.assertRegex(report, "(?m)^warning: Ball: ")

    def test_a_strip_stays_where_it_was_moved_and_is_missed_when_it_is_deleted(self):
        self.assertEqual([strip["start"] for strip in self.found["usual strips"]], [8])
        self.assertEqual(self.found["stale"], [False, True])

    def test_keys_are_heard_without_a_simulation(self):
        self.assertEqual(self.found["keyed"]["result"], ["FINISHED"], self.found["keyed"])
        samples = sound.read_wave(self.folder / "carillon" / "keyed-Scene" / "sound.wav").sum(axis=-1)
        self.assertAlmostEqual(self.onset_s(samples), self.found["keyed lands"], delta=0.001)

    def test_a_marker_that_changes_the_camera_cuts_the_sound(self):
        self.assertFalse(self.found["keyed stale"])
        samples = sound.read_wave(self.folder / "carillon" / "keyed-Scene" / "sound.wav")
        cut = 17 * sound.RATE // 60
        left, right = numpy.abs(samples[cut - sound.RATE // 100:cut]).max(axis=0)
        self.assertAlmostEqual(left / right, 1, delta=0.01)
        left, right = numpy.abs(samples[cut + sound.RATE // 20:cut + sound.RATE // 10]).max(axis=0)
        self.assertLess(left, 0.05 * right)

    def test_the_parts_of_a_compound_are_united_but_for_those_that_only_collide(self):
        top, leg = 0.5 * 0.5 * 0.03, 0.04 * 0.04 * 0.4
        for case, volume in (("compound", top + 2 * leg - 0.04 * 0.04 * 0.015), ("compound of none", top)):
            body = self.found[case]
            self.assertAlmostEqual(body["volume"], volume, delta=1e-4 * volume)
            # One closed surface without a handle.
            self.assertEqual((body["closed"], body["euler"], body["collided"]), (True, 2, 24), case)

    def test_spheres_touch_meshes_without_the_margin_of_the_simulator(self):
        self.assertEqual(self.found["margins"], [0, 0.04])

    def test_the_report_names_sound_without_radiation(self):
        self.assertIn("Radiation", self.found["usual"]["report"])
        self.assertNotIn("Radiation", self.found["keyed"]["report"])
