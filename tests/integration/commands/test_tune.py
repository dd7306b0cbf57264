# SPDX-License-Identifier: Apache-2.0
"""`carillon model tune`: a bar gets its pitch by its size, its length or its thickness, and the model that is stored
has it; free and clamped bars follow the theory of beams."""

import math

import meshes
from daemon import DaemonTest

SIDES_M = (0.2, 0.02, 0.004)
STEEL = ("--young", 2e11, "--poisson", 0.3, "--density", 8000, "--alpha1", 0, "--alpha2", 1)


class Tune(DaemonTest):

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.mesh = cls.folder / "bar.obj"
        cls.mesh.write_bytes(meshes.obj(*meshes.box(SIDES_M)))
        cls.daemon.command("model", "create", cls.mesh, "--wait", "--without-transfer", "--band", "20:4000", *STEEL)

    def tune(self, model, *options):
        return self.daemon.json("model", "tune", model, *options)

    def modes(self, model):
        return self.daemon.json("model", "show", model)["frequencies_hz"]

    def models(self):
        return self.daemon.json("model", "list")["modal_models"]

    def test_size_is_the_ratio_of_the_frequencies(self):
        base = self.modes("bar")
        tuned = self.tune("bar", "--to", "A4", "--mode", 2)
        self.assertAlmostEqual(tuned["size"], base[1] / 440, delta=1e-6)
        self.assertAlmostEqual(tuned["frequency_hz"], 440, delta=1e-6)

    def test_the_stored_model_of_a_stretched_bar_has_the_pitch(self):
        count = len(self.models())
        base = self.modes("bar")[0]
        # Bending goes with thickness/length^2; shear, and the mesh, change that a little in a slender bar.
        for by, power in (("length", -2), ("thickness", 1)):
            with self.subTest(by=by):
                tuned = self.tune("bar", "--to", 440, "--by", by)
                self.assertAlmostEqual(1200 * math.log2(self.modes(tuned["modal_model"])[0] / 440), 0, delta=0.4)
                self.assertAlmostEqual(tuned["scale"] / (440 / base) ** (1 / power), 1, delta=0.01)
                self.assertAlmostEqual(tuned["length_m"], SIDES_M[0 if by == "length" else 2] * tuned["scale"],
                                       delta=1e-6)
        self.assertEqual(len(self.models()), count + 2, "the models of other lengths are deleted")

    def test_a_plane_that_clamps_a_bar_moves_with_it(self):
        self.daemon.command("model", "create", self.mesh, "--label", "tine", "--wait", "--without-transfer", "--band",
                            "20:2000", "--fix", "plane:0.05,0,0/1,0,0", *STEEL)
        base = self.modes("tine")[0]
        tuned = self.tune("tine", "--to", 220, "--by", "length")
        # The whole bar and the clamped part grow alike.
        self.assertAlmostEqual(tuned["scale"] / math.sqrt(base / 220), 1, delta=0.01)

    def test_a_length_that_does_nothing_is_refused(self):
        count = len(self.models())
        for reason, *options in (("PITCH_NOT_REACHED", "A4", "--by", "y"), ("PITCH_NOT_REACHED", 1, "--by", "length"),
                                 ("INVALID_SETTINGS", "A4", "--mode", 99)):
            self.assertEqual(self.daemon.refusal("model", "tune", "bar", "--to", *options), reason)
        self.assertEqual(len(self.models()), count)
