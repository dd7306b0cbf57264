# SPDX-License-Identifier: AGPL-3.0-or-later
"""Ill-made surfaces end in the body that was meant or in their own reason: those that are quick, and all of them with
CARILLON_TORTURE=long."""

import json
import os
import pathlib
import subprocess
import tempfile
import unittest
from collections import namedtuple

import ill_made_surfaces

# First natural frequencies of the sound bodies are the measure of all others: linear elements, so that a
# dense wrap is quick; they lock by several percent, and more on the sound bodies' coarser meshes.
OPTIONS = ["--material", "aluminum_6061", "--element", "linear", "--mass", "lumped", "--nodes", "4000"]
TOLERANCE = 0.06
TIME_LIMIT_S = 600
# Their wraps and walls are fine meshes of large bodies.
SLOW = ("ball", "needles", "edge", "corner", "lid", "plate", "crossed", "spike", "tube", "cavity")
SKIPPED = () if os.environ.get("CARILLON_TORTURE") == "long" else SLOW

Verdict = namedtuple("Verdict", "outcome first_hz warnings")


def decompose(content, options):
    """Outcome "model", a reason, or what must not be: "crash", "hang"."""
    with tempfile.TemporaryDirectory(prefix="carillon-surface-") as folder:
        mesh = pathlib.Path(folder) / "surface.obj"
        mesh.write_bytes(content)
        command = [os.environ["CARILLON_PRECOMPUTE"], mesh, "--out", pathlib.Path(folder) / "model", "--json",
                   "--threads", "1", *OPTIONS, *options]
        try:
            ended = subprocess.run(command, capture_output=True, text=True, timeout=TIME_LIMIT_S,
                                   check=False)
        except subprocess.TimeoutExpired:
            return Verdict("hang", None, [])
    try:
        printed = json.loads(ended.stdout)
    except json.JSONDecodeError:
        return Verdict(f"crash ({ended.returncode})", None, [])
    if "error" in printed:
        return Verdict(printed["error"]["reason"], None, [printed["error"]["message"]])
    return Verdict("model", printed["modes"][0]["frequency_hz"], printed.get("warnings", []))


def fault(expected, verdict, sound_hz):
    """Why this is not what was expected, or None. A reason may be given by its beginning."""
    if expected in sound_hz or expected == "model":
        if verdict.outcome != "model":
            return f"expected a model: {' '.join(verdict.warnings)}"
        if expected in sound_hz and abs(verdict.first_hz / sound_hz[expected] - 1) > TOLERANCE:
            return f"first mode {verdict.first_hz:.1f} Hz, of the sound body {sound_hz[expected]:.1f}"
        return None
    if expected.startswith("MESH_") and verdict.outcome.startswith(expected):
        return None
    return f"expected {expected}"


class SurfacesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        bodies = {"bar": ill_made_surfaces.bar(), "ball": ill_made_surfaces.ball()}
        cls.sound_hz = {name: decompose(ill_made_surfaces.obj(part), []).first_hz
                        for name, part in bodies.items()}
        cls.cases = [case for case in ill_made_surfaces.cases()
                     if not any(word in case.name for word in SKIPPED)]

    def check(self, more, expected):
        for case in self.cases:
            with self.subTest(case.name):
                verdict = decompose(case.content, case.options + more)
                wrong = fault(expected(case), verdict, self.sound_hz)
                self.assertIsNone(wrong, f"{verdict.outcome}: {wrong}")

    def test_as_given_each_is_a_body_or_has_its_reason(self):
        self.check([], lambda case: case.plain)

    def test_repaired_each_is_the_body_that_was_meant_or_has_its_reason(self):
        self.check(["--repair"], lambda case: case.repaired)

    def test_a_repair_says_what_it_did(self):
        by_name = {case.name: case for case in ill_made_surfaces.cases()}
        for name, word in (("30% of the triangles turned", "turned round"), ("5 T-junctions", "cut"),
                           ("gaps of 3e-06 m", "corners of open edges joined"),
                           ("gaps of 3e-05 m", "corners of open edges joined"),
                           ("the shell twice", "dropped"), ("3 triangles missing", "holes closed"),
                           ("a wall inside", "wrapped")):
            with self.subTest(name):
                said = "\n".join(decompose(by_name[name].content, ["--repair"]).warnings)
                self.assertIn(word, said)
                self.assertEqual(word == "wrapped", "wrapped" in said, said)


if __name__ == "__main__":
    unittest.main()
