# SPDX-License-Identifier: Apache-2.0
"""Commands that move models, and what `strike` and `transfer` say of a model."""

import unittest

import meshes
from test_command_line import CommandLineTest


class ModelFilesTest(CommandLineTest):
    def test_a_glb_has_the_material_of_the_model_unless_another_is_named(self):
        poisson = self.json_of("model", "show", "bar")["header"]["settings"]["poisson_ratio"]
        for material, words in ((meshes.MATERIAL, ()), ("oak", ("--material", "oak", "--poisson", poisson))):
            self.run_command("model", "export", "bar", "--out", self.folder / "remembered.glb", *words)
            self.assertIn(f'"{material}"'.encode(), (self.folder / "remembered.glb").read_bytes())

    def test_an_import_says_that_its_label_is_shared_and_each_outcome_of_a_deletion_is_told(self):
        self.run_command("model", "export", "bar", "--out", self.folder / "shared.npz")
        imported = self.run_command("model", "import", self.folder / "shared.npz").strip()
        self.assertEqual(self.json_of("model", "show", "shared")["name"], imported)
        done = self.daemon.command("model", "import", self.folder / "shared.npz", "--label", "bar")
        other = done.stdout.strip()
        shown = other.removeprefix("modalModels/")[:12]
        self.assertIn(f"the label 'bar' now means 2 models: name this one {shown} and the other ", done.stderr)
        self.assertIn("NAME_AMBIGUOUS: 'bar' means 2 of the models: ",
                      self.daemon.command("model", "show", "bar", check=False).stderr)
        deleted = self.daemon.command("model", "delete", "nothing", shown, check=False)
        self.assertEqual((deleted.returncode, deleted.stdout), (1, f"{other} deleted\n"))
        self.assertIn("MODAL_MODEL_NOT_FOUND", deleted.stderr)
        self.run_command("model", "show", "bar")


class StrikeJsonTest(CommandLineTest):
    def test_json_has_the_warning_of_the_plain_output(self):
        strike = ("strike", "bar", "--impulse", "0,0,-0.01", "--seconds", "0.01", "--point")
        self.assertEqual(self.json_of(*strike, "0,0.008,0.01")["warnings"], [])
        plain = self.daemon.command(*strike, "0,0,9").stderr
        warning, = self.json_of(*strike, "0,0,9")["warnings"]
        self.assertRegex(warning, "^POINTS_DISTANT: ")
        self.assertEqual(plain, f"warning: {warning}\n")

    def test_json_has_the_duration_and_the_peak_and_tells_of_the_limiter(self):
        strike = ("strike", "bar", "--point", "0,0.008,0.01", "--duration", "0.002", "--seconds", "0.01", "--impulse")
        shown, loud = (self.json_of(*strike, impulse) for impulse in ("0,0,-0.01", "0,0,-100"))
        self.assertAlmostEqual(shown["contact_duration_s"], 0.002)
        self.assertEqual((shown["seconds"], shown["limited_frame_count"]), (0.01, 0))
        self.assertAlmostEqual(loud["peak_pa"], 1e4 * shown["peak_pa"], delta=10 * shown["peak_pa"])
        self.assertGreater(loud["limited_frame_count"], 0)
        self.assertIn("which the limiter lowers", self.run_command(*strike, "0,0,-100"))


class TransferMaterialTest(CommandLineTest):
    def test_a_transfer_for_another_material_comes_with_a_warning(self):
        warned = self.daemon.command("transfer", "bar", "--material", "lead", "--no-wait")
        self.assertIn("warning: the material's Poisson's ratio is ", warned.stderr)
        self.assertIn(f"warning: the model was made of {meshes.MATERIAL}", warned.stderr)
        self.assertEqual(self.daemon.command("transfer", "bar", "--material", meshes.MATERIAL).stderr, "")


if __name__ == "__main__":
    unittest.main()
