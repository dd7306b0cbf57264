# SPDX-License-Identifier: Apache-2.0
"""What `carillond --check-config` finds in a configuration, and that a start finds the same."""

import json
import socket
import subprocess

from daemon import BIN, ScratchTest


class ConfigurationTest(ScratchTest):
    def setUp(self):
        super().setUp()
        self.file = self.folder / "carillond.toml"

    def run_daemon(self, settings, *arguments):
        """Runs carillond with a configuration with these settings."""
        usual = {"data_dir": f"{self.folder}/data", "listen": [f"unix:{self.folder}/socket"], "audio_device": "null"}
        self.file.write_text("".join(f"{key} = {json.dumps(value)}\n" for key, value in (usual | settings).items()))
        return subprocess.run([BIN / "carillond", "--config", self.file, *arguments], capture_output=True, text=True,
                              check=False, timeout=60)

    def wrong_settings(self):
        """Settings that a start refuses, each with the beginning of the refusal."""
        return (({"listen": ["foo"]}, "INVALID_CONFIGURATION"),
                ({"listen": ["127.0.0.1:99999"]}, "INVALID_CONFIGURATION"),
                ({"listen": ["0.0.0.0:5001"]}, "TLS_REQUIRED"),
                ({"listen": [f"unix:{self.folder}/empty"]}, "LISTEN_FAILED"),
                ({"listen": ["127.0.0.1:0"], "tls_certificate": "/nope", "tls_key": "/nope"},
                 "TLS_UNUSABLE"),
                ({"access_file": "/nope"}, "ACCESS_FILE_UNUSABLE"),
                ({"audio_device": "alsa"}, "INVALID_CONFIGURATION"),
                ({"audio_device": ""}, "INVALID_CONFIGURATION"),
                ({"audio_device": "file:/proc/self/mountinfo"}, "INVALID_CONFIGURATION"),
                ({"audio_device": f"file:{self.folder}/no/a.wav"}, "OUTPUT_NOT_WRITABLE: cannot write"),
                ({"audio_device": f"file:{self.folder}"}, "OUTPUT_NOT_WRITABLE: cannot write"),
                ({"head": "/nope.sofa"}, "HEAD_UNUSABLE"),
                ({"precompute": "/nope"}, "WORKER_NOT_FOUND"),
                ({"data_dir": "/proc/x"}, "DATABASE_UNUSABLE"),
                ({"data_dir": f"{self.folder}/empty"}, "DATABASE_UNUSABLE"),
                ({"sample_rate": 1}, "INVALID_CONFIGURATION: sample_rate: "))

    def test_what_a_start_would_refuse_is_found_by_the_check_and_ends_with_status_2(self):
        (self.folder / "empty").touch(0o600)
        files = sorted([*self.folder.iterdir(), self.file])
        for settings, reason in self.wrong_settings():
            word, _, message = reason.partition(": ")
            wrong = "tls_certificate" if "tls_certificate" in settings else min(settings)
            # The first three lines are those of run_daemon.
            line = 1 + [*dict.fromkeys(("data_dir", "listen", "audio_device", *settings))].index(wrong)
            for arguments in (("--check-config",), ()):
                with self.subTest(settings=settings, arguments=arguments):
                    refused = self.run_daemon(settings, *arguments)
                    self.assertEqual((refused.returncode, refused.stdout), (2, ""), refused.stderr)
                    self.assertIn(f"error: {word}: {self.file} line {line}: {message}", refused.stderr)
        self.assertEqual(sorted(self.folder.iterdir()), files)  # nothing was made

    def test_what_a_start_takes_is_valid_and_the_check_makes_nothing(self):
        for settings in ({}, {"listen": ["127.0.0.1:0", "127.0.0.1:0"]}, {"metrics": "localhost:9464"},
                         {"listen": ["127.0.0.1:0"]}, {"listen": [f"unix:{self.folder}/a/b/socket"]},
                         {"data_dir": f"{self.folder}/a/b/c"}, {"audio_device": f"file:{self.folder}/a.wav"},
                         {"slurm_dir": "/on/each/node", "precompute": "/on/each/node/precompute"}):
            with self.subTest(settings=settings):
                checked = self.run_daemon(settings, "--check-config")
                self.assertEqual((checked.returncode, checked.stdout), (0, "the configuration is valid\n"),
                                 checked.stderr)
        self.assertEqual(list(self.folder.iterdir()), [self.file])

    def test_a_flag_that_overrides_the_file_is_not_blamed_on_the_file(self):
        refused = self.run_daemon({"listen": [f"unix:{self.folder}/a"]}, "--check-config", "--listen", "foo")
        self.assertEqual(refused.returncode, 2)
        self.assertRegex(refused.stderr, 'error: INVALID_CONFIGURATION: "?foo')

    def test_a_database_that_this_user_may_not_write_is_found_by_the_check(self):
        self.assertEqual(self.run_daemon({}, "db", "check").returncode, 1)  # there is none yet
        data = self.folder / "data"
        data.mkdir(exist_ok=True)
        (data / "carillon.db").symlink_to("carillon.db")
        checked = self.run_daemon({}, "--check-config")
        self.assertEqual(checked.returncode, 2)
        self.assertIn(f'DATABASE_UNUSABLE: {self.file} line 1: "{data}/carillon.db" cannot be used: ', checked.stderr)

    def test_metrics_at_a_port_that_is_taken_are_valid_but_stop_a_start_with_the_cause(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            metrics = f"127.0.0.1:{taken.getsockname()[1]}"
            checked = self.run_daemon({"metrics": metrics}, "--check-config")
            started = self.run_daemon({"metrics": metrics})
        self.assertEqual(checked.returncode, 0, checked.stderr)
        self.assertEqual(started.returncode, 1)
        self.assertIn(f"error: LISTEN_FAILED: cannot serve metrics on {metrics}: ", started.stderr)
        self.assertIn("let --metrics name a free port", started.stderr)
