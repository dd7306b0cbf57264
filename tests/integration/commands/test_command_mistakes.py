# SPDX-License-Identifier: Apache-2.0
"""What the command line answers to mistakes, and when its output is lost."""

import json
import os
import subprocess
import unittest

from daemon import BIN, ROOT
from test_command_line import CREATE, STRIKE, CommandLineTest, run_alone


class RefusedTest(CommandLineTest):
    def test_a_refusal_by_the_daemon_is_printed_with_its_reason(self):
        for words, reason in ((("stop", "99999"), "SCENE_NOT_FOUND"),
                              (("model", "create", self.folder / "bar.obj", "--young", "3"), "INVALID_MATERIAL"),
                              ((*STRIKE, "--modes-only"), "TRANSFER_NOT_FOUND"),
                              ((*STRIKE, "--material-file", self.folder), "FILE_NOT_FOUND"),
                              (("model", "list", "--page-size", "3", "--page-token", "x"), "INVALID_SETTINGS"),
                              (("model", "show", "nothing"), "MODAL_MODEL_NOT_FOUND")):
            self.assertEqual(self.daemon.refusal(*words), reason)

    def test_options_for_folders_and_other_formats_are_refused(self):
        trace = self.write_trace()
        for words, expected in (((trace, "--out", "x.mp3"), 'x.mp3" must end with .wav'),
                                ((trace, "--out", "x.wav", "--stems"), "--stems: is for a folder"),
                                ((trace, "--out", "x.wav", "--shard", "1/2"), "--shard: is for a folder"),
                                ((self.folder, "--out", "-"), '--out: "-" must be a folder'),
                                ((self.folder, "--out", trace), 'contacts" must be a folder')):
            done = self.daemon.command("render", *words, check=False)
            self.assertEqual(done.returncode, 2)
            self.assertIn(expected, done.stderr)

    def run_command_to(self, stdout, *words):
        """The command with `stdout`, or with a closed one for None; returns (exit code, stderr)."""
        def close():
            if stdout is None:
                os.close(1)

        done = self.daemon.command(*words, check=False, capture_output=False, stdout=stdout, stderr=subprocess.PIPE,
                                   preexec_fn=close)
        return done.returncode, done.stderr

    def test_no_command_succeeds_whose_output_is_lost(self):
        trace = self.write_trace()
        commands = (("--help",), ("--version",), ("--help-all",), ("status",), ("db", "stats"),
                    ("doctor",), ("model", "list"), ("model", "show", "bar"), ("job", "list"), ("job", "show", "bar"),
                    ("job", "watch", "bar"), ("material",), ("volume",), ("stop",),
                    ("listen", "--seconds", "0.1"), STRIKE,
                    ("render", trace, "--out", "-"), ("render", trace, "--out", self.folder / "lost.wav"),
                    ("example", "bar", "--out", self.folder / "lost.obj"),
                    ("model", "export", "bar", "--out", self.folder / "lost.model"),
                    (*CREATE, self.folder / "bar.obj"))
        self.c.scene()
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
        strike = "strike bar --point 0,0,0 --impulse 0,0,1"
        create = f"model create {ROOT}/README.md"
        for command, *options in ((strike, "--size 0", "--seconds -3", "--seconds 0", "--seconds nan", "--gain -6"),
                                  (create, "--size 0", "--accuracy 1", "--budget 0", "--memory-limit-mib -3"),
                                  ("strike bar --point 0,0,0", "--impulse 0,0,0"),
                                  ("strike bar --impulse 0,0,1", "--point 0,0"),
                                  ("transfer bar", "--accuracy 0", "--budget 0", "--size 0"),
                                  ("listen", "--out x.ogg", "--seconds 0", "--json"), ("example bar", "--out x.stl"),
                                  ("model export bar", "--out x.obj"), ("render x.contacts --out -", "--json"),
                                  ("status", "--server 127.0.0.1:99999")):
            for option in options:
                with self.subTest(command=command, option=option):
                    self.assert_refused(option.split()[0], *command.split(), *option.split())
        self.assert_refused("--help", "job")
        asked = run_alone("status", env={**os.environ, "CARILLON_SERVER": "localhost"})
        self.assertIn('"localhost" must be unix:PATH, or HOST:PORT', asked.stderr)

    def assert_refused(self, option, *words):
        done = run_alone(*words)
        self.assertEqual(done.returncode, 2)
        self.assertIn(option, done.stderr)
        if option != "--json":
            self.assertEqual(done.stdout, "")
            done = run_alone("--json", *words)
        error = json.loads(done.stdout)["error"]
        self.assertEqual(error["reason"], "INVALID_SETTINGS")
        self.assertIn(error["message"].split("\n")[0], done.stderr)
