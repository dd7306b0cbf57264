# SPDX-License-Identifier: AGPL-3.0-or-later
"""Ill-made surfaces end in the body that was meant or in their own reason: those that are quick, and all of them with
CARILLON_TORTURE=long."""

import os
import pathlib
import unittest

import ill_made_surfaces
import surfaces

PROGRAM = pathlib.Path(os.environ["CARILLON_PRECOMPUTE"])
# Their wraps and walls are fine meshes of large bodies.
SLOW = ("ball", "needles", "edge", "corner", "lid", "plate", "crossed", "spike", "tube", "cavity")
SKIPPED = () if os.environ.get("CARILLON_TORTURE") == "long" else SLOW


class SurfacesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.sound_hz = surfaces.sound_bodies_hz(PROGRAM)
        cls.cases = [case for case in ill_made_surfaces.cases()
                     if not any(word in case.name for word in SKIPPED)]

    def check(self, more, expected):
        for case in self.cases:
            with self.subTest(case.name):
                verdict = surfaces.decompose(PROGRAM, case.content, case.form, case.options + more)
                fault = surfaces.fault(expected(case), verdict, self.sound_hz)
                self.assertIsNone(fault, f"{verdict.outcome}: {fault}")

    def test_as_given_each_is_a_body_or_has_its_reason(self):
        self.check([], lambda case: case.plain)

    def test_repaired_each_is_the_body_that_was_meant_or_has_its_reason(self):
        self.check(["--repair"], lambda case: case.repaired)

    def test_a_repair_says_what_it_did(self):
        by_name = {case.name: case for case in ill_made_surfaces.cases()}
        for name, word in (("30% of the triangles turned", "turned round"),
                           ("5 T-junctions", "cut"), ("the shell twice", "dropped"),
                           ("3 triangles missing", "holes closed"), ("a wall inside", "wrapped")):
            with self.subTest(name):
                case = by_name[name]
                verdict = surfaces.decompose(PROGRAM, case.content, case.form, ["--repair"])
                self.assertTrue(any(word in warning for warning in verdict.warnings),
                                verdict.warnings)


if __name__ == "__main__":
    unittest.main()
