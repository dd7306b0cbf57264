# SPDX-License-Identifier: Apache-2.0
"""Commands that move models and listeners, and the names by which they find them."""

import os
import socket
import subprocess
import time
import unittest

import meshes
from carillon.v1 import scene_service_pb2
from daemon import BIN
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
        warned = self.daemon.command("transfer", "create", "bar", "--material", "lead", "--no-wait")
        self.assertIn("warning: the material's Poisson's ratio is ", warned.stderr)
        self.assertIn(f"warning: the model was made of {meshes.MATERIAL}", warned.stderr)
        self.assertEqual(self.daemon.command("transfer", "create", "bar", "--material", meshes.MATERIAL).stderr, "")


class CompletionTest(CommandLineTest):
    def complete(self, line, server=None):
        words = [BIN / "carillon", *line.split(" ")]
        script = self.run_command("completion", "bash") + (
            f"\nCOMP_WORDS=({' '.join(repr(str(word)) for word in words)}); COMP_CWORD={len(words) - 1}\n"
            '_carillon; printf "%s\\n" "${COMPREPLY[@]}"\n')
        return subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True, env={
            **os.environ, "CARILLON_SERVER": server or self.daemon.server}).stdout.split()

    def test_bash_completes_names_of_the_program_and_of_the_daemon(self):
        scene = self.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest(id="lathe-1")).name
        self.assertEqual(self.complete("model create bell.obj --material bell_"), ["bell_bronze"])
        self.assertEqual(self.complete("strike bar --striker stee"), ["steel"])
        self.assertEqual(self.complete("model show b"), ["bar"])
        self.assertEqual(self.complete("job watch ba"), ["bar"])
        self.assertEqual(self.complete("scene delete la"), ["lathe-1"])
        self.assertEqual(self.complete("volume --scene la"), ["lathe-1"])
        self.run_command("scene", "delete", scene)

    def test_zsh_and_fish_complete_names(self):
        environment = {**os.environ, "CARILLON_SERVER": self.daemon.server, "PATH": f"{BIN}:{os.environ['PATH']}"}
        for shell, asked in (("zsh", "compdef() { :; }; _files() { :; }; compadd() { print -l -- $choices }\n{}\n"
                                     "words=(carillon model show b); CURRENT=4; _carillon"),
                             ("fish", "{}\ncomplete -C 'carillon model show b'")):
            script = asked.replace("{}", self.run_command("completion", shell))
            shown = subprocess.run([shell, "-c", script], capture_output=True, text=True, check=True, env=environment)
            self.assertIn("bar", shown.stdout.split(), shown.stderr)

    def test_names_that_are_shared_or_need_quotation_marks_are_digests(self):
        self.run_command("model", "tag", "bar", "--label", "a bar")
        digest = self.model.removeprefix("modalModels/")[:12]
        self.assertEqual(self.complete(f"model show {digest[:3]}"), [digest])
        self.run_command("model", "tag", digest, "--label", "bar")

    def test_without_a_daemon_there_are_no_names_and_a_silent_one_is_not_waited_for(self):
        self.assertEqual(self.complete("model show b", f"unix:{self.folder}/nobody"), [])
        with socket.socket() as silent:
            silent.bind(("127.0.0.1", 0))
            silent.listen()
            begin = time.monotonic()
            self.assertEqual(self.complete("model show b", f"127.0.0.1:{silent.getsockname()[1]}"), [])
            self.assertLess(time.monotonic() - begin, 5)


if __name__ == "__main__":
    unittest.main()
