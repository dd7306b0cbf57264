# SPDX-License-Identifier: Apache-2.0
"""What the command line answers to mistakes, and when its output is lost."""

import json
import os
import subprocess
import unittest

import meshes
import sound
from carillon.v1 import contact_pb2, contact_trace_pb2, scene_service_pb2
from daemon import BIN, ROOT
from test_command_line import MATERIAL, CommandLineTest, carillon


class MessagesTest(CommandLineTest):
    def test_a_refusal_by_the_daemon_is_printed_with_its_reason(self):
        strike = ("strike", "bar", "--point", "0,0.008,0.01", "--impulse", "0,0,-0.01")
        for words, reason in ((("stop", "99999"), "SCENE_NOT_FOUND"),
                              (("model", "create", self.folder / "bar.obj", "--young", "3"), "INVALID_MATERIAL"),
                              ((*strike, "--modes-only"), "TRANSFER_NOT_FOUND"),
                              (("model", "list", "--page-size", "3", "--page-token", "x"), "INVALID_SETTINGS")):
            done = self.daemon.command(*words, check=False)
            self.assertEqual((done.returncode, done.stdout), (1, ""))
            self.assertRegex(done.stderr, f"^carillon: {reason}: .")


class RenderMistakesTest(CommandLineTest):

    def test_options_for_folders_and_other_formats_are_refused(self):
        trace = self.folder / "trace.contacts"
        sound.write_trace(trace, [], [])
        for words, expected in (((trace, "--out", "x.mp3"), 'x.mp3" must end with .wav'),
                                ((trace, "--out", "x.wav", "--stems"), "--stems: is for a folder"),
                                ((trace, "--out", "x.wav", "--shard", "1/2"), "--shard: is for a folder"),
                                ((self.folder, "--out", "-"), '--out: "-" must be a folder'),
                                ((self.folder, "--out", trace), 'contacts" must be a folder')):
            done = self.daemon.command("render", *words, check=False)
            self.assertEqual(done.returncode, 2)
            self.assertIn(expected, done.stderr)


class LostOutputTest(CommandLineTest):
    def run_command_to(self, stdout, *words):
        """The command with `stdout`, or with a closed one for None; returns (exit code, stderr)."""
        def close():
            if stdout is None:
                os.close(1)

        done = subprocess.run([BIN / "carillon", "--server", self.daemon.server, *map(str, words)], stdout=stdout,
                              stderr=subprocess.PIPE, text=True, check=False, preexec_fn=close)
        return done.returncode, done.stderr

    def test_no_command_succeeds_whose_output_is_lost(self):
        trace = self.folder / "lost.contacts"
        impulse = sound.impulse((0, 0.008, 0.010), (0, 0, -0.002), duration_s=1e-4)
        item = contact_trace_pb2.ContactTraceObject(handle=1, modal_model=self.model, material=MATERIAL)
        sound.write_trace(trace, [item], [contact_pb2.ContactStep(time_s=0, contacts=[impulse])])
        strike = ("strike", "bar", "--point", "0,0.008,0.01", "--impulse", "0,0,-0.01", "--seconds", "0.01")
        commands = (("--help",), ("--version",), ("--help-all",), ("status",), ("db", "stats"),
                    ("doctor",), ("model", "list"), ("model", "show", "bar"), ("job", "list"), ("job", "show", "bar"),
                    ("job", "watch", "bar"), ("material",), ("volume",), ("stop",),
                    ("listen", "--seconds", "0.1"), strike,
                    ("render", trace, "--out", "-"), ("render", trace, "--out", self.folder / "lost.wav"),
                    ("example", "bar", "--out", self.folder / "lost.obj"),
                    ("model", "export", "bar", "--out", self.folder / "lost.model"),
                    ("model", "create", self.folder / "bar.obj", "--material", meshes.MATERIAL))
        self.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest())
        with open("/dev/full", "wb") as full:
            for words in commands:
                for stdout in (full, None):
                    code, errors = self.run_command_to(stdout, *words)
                    self.assertEqual(code, 1, words)
                    self.assertRegex(errors, "OUTPUT_NOT_WRITABLE|NOT_SERVING", words)

    def test_a_reader_that_has_heard_enough_ends_the_recording(self):
        with subprocess.Popen([BIN / "carillon", "--server", self.daemon.server, "listen"], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE) as listener:
            self.assertEqual(len(listener.stdout.read(4096)), 4096)
            listener.stdout.close()
            self.assertEqual(listener.wait(10), 0, listener.stderr.read())


class WrongValuesTest(unittest.TestCase):
    def test_values_that_would_be_taken_for_others_are_refused(self):
        strike = ("strike", "bar", "--point", "0,0,0", "--impulse", "0,0,1")
        create = ("model", "create", ROOT / "README.md")
        for words, expected in (((*strike[:-1], "0,0,0"), "--impulse: a strike with an impulse of 0,0,0 is silent"),
                                (("strike", "bar", "--point", "0,0", "--impulse", "0,0,1"),
                                 "--point cannot be 0,0: The struck point: X,Y,Z or X Y Z"),
                                (("job",), "Run with --help"),
                                ((*strike, "--size", "0"), '--size: "0" must be a number from 0.001 to 1000'),
                                ((*strike, "--seconds", "-3"), '--seconds: "-3" must be a number from 0.001 to 1e+09'),
                                ((*strike, "--seconds", "0"), "leave --seconds out to hear the sound until it has"),
                                ((*strike, "--seconds", "nan"), '--seconds: "nan" must be'),
                                ((*strike, "--gain", "-6"), "or decibels, such as -6dB"),
                                ((*create, "--size", "0"), "--size"),
                                ((*create, "--accuracy", "1"), "1 is 100%"),
                                ((*create, "--budget", "0"), "not both zero; leave it out for the default"),
                                (("transfer", "bar", "--accuracy", "0"),
                                 '"0" must be a number from 0.06 to 20; leave it out for 2 dB'),
                                (("transfer", "bar", "--budget", "0"), "leave it out for a time by the size"),
                                ((*create, "--memory-limit-mib", "-3"), "--memory-limit-mib"),
                                (("transfer", "bar", "--size", "0"), "--size"),
                                (("listen", "--out", "x.ogg"), "must end with .wav"),
                                (("listen", "--seconds", "0"), "leave --seconds out to record until the program"),
                                (("model", "export", "bar", "--out", "x.obj"), "must end with .model, .glb"),
                                (("example", "bar", "--out", "x.stl"), "must end with .obj"),
                                (("--json", "listen"), "--json: stdout has the sound"),
                                (("--json", "render", "x.contacts", "--out", "-"), "--json: stdout has the sound"),
                                (("--server", "127.0.0.1:99999", "status"), "a port from 1 to 65535")):
            done = carillon(*words)
            self.assertEqual(done.returncode, 2, words)
            self.assertIn(expected, done.stderr)
            if "--json" not in words:
                self.assertEqual(done.stdout, "", words)
                done = carillon("--json", *words)
            error = json.loads(done.stdout)["error"]
            self.assertEqual(error["reason"], "INVALID_SETTINGS")
            self.assertIn(error["message"].split("\n")[0], done.stderr)
        asked = carillon("status", env={**os.environ, "CARILLON_SERVER": "localhost"})
        self.assertIn('"localhost" must be unix:PATH, or HOST:PORT', asked.stderr)


if __name__ == "__main__":
    unittest.main()
