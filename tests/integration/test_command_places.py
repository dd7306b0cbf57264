# SPDX-License-Identifier: Apache-2.0
"""Commands that move models and listeners, and the names by which they find them."""

import unittest

import meshes
from carillon.v1 import scene_service_pb2
from test_command_line import CommandLineTest


class ModelFilesTest(CommandLineTest):
    def test_a_glb_has_the_material_of_the_model_unless_another_is_named(self):
        poisson = self.json_of("model", "show", "bar")["header"]["settings"]["poisson_ratio"]
        for material, words in ((meshes.MATERIAL, ()), ("oak", ("--material", "oak", "--poisson", poisson))):
            self.run_command("model", "export", "bar", "--out", self.folder / "remembered.glb", *words)
            self.assertIn(f'"{material}"'.encode(), (self.folder / "remembered.glb").read_bytes())

    def test_an_import_says_that_its_label_is_shared_and_each_outcome_of_a_deletion_is_told(self):
        self.run_command("model", "export", "bar", "--out", self.folder / "shared.npz")
        done = self.daemon.command("model", "import", self.folder / "shared.npz", "--label", "bar")
        other = done.stdout.strip()
        shown = other.removeprefix("modalModels/")[:12]
        self.assertIn(f"the label 'bar' now means 2 models: name this one {shown} and the other ", done.stderr)
        self.assertIn("MODAL_MODEL_AMBIGUOUS: 'bar' means 2 of the models: ",
                      self.daemon.command("model", "show", "bar", check=False).stderr)
        deleted = self.daemon.command("model", "delete", "nothing", shown, check=False)
        self.assertEqual((deleted.returncode, deleted.stdout), (1, f"{other} deleted\n"))
        self.assertIn("MODAL_MODEL_NOT_FOUND", deleted.stderr)
        self.run_command("model", "show", "bar")


class SceneListenerTest(CommandLineTest):
    def test_a_listener_is_moved_and_turned(self):
        heard = scene_service_pb2.CreateSceneRequest()
        heard.hearing.distance_gain = True
        scene = self.client.scenes.CreateScene(heard).name
        self.assertEqual(self.run_command("scene", "listener", scene, "--position", "-1,0,2"), "")
        asked = self.json_of("scene", "listener", scene.removeprefix("scenes/"), "--position", 1, 2, -3,
                             "--orientation", "0,0,1,0", "--glide", 0.5)
        self.assertEqual((asked["scene"], asked["pose"]["position_m"]["z"], asked["glide_s"]), (scene, -3, 0.5))
        self.assertEqual(asked["pose"]["orientation"], {"w": 0, "x": 0, "y": 1, "z": 0})
        done = self.daemon.command("scene", "listener", scene, "--position", "0,0,0", "--orientation", "1,1,0,0",
                                   check=False)
        self.assertIn("INVALID_POSE: a quaternion is of length", done.stderr)
        self.assertEqual(self.json_of("scene", "delete", scene), {"scene": scene})


if __name__ == "__main__":
    unittest.main()
