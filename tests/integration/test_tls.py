# SPDX-License-Identifier: Apache-2.0
"""The daemon over TLS, with a certificate made here."""

import pathlib
import re
import socket
import subprocess
import tempfile
import time
import unittest
import urllib.request

from certificates import self_signed
from daemon import BIN, Daemon


class TlsTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.certificate, self.key = self_signed(self.folder)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.metrics = f"127.0.0.1:{free.getsockname()[1]}"
        self.daemon = Daemon(self.folder, "--listen", "127.0.0.1:0", "--tls-certificate", self.certificate,
                             "--tls-key", self.key, "--metrics", self.metrics)
        self.addCleanup(self.daemon.stop)
        self.address = self.daemon.listening[1].split()[-1]

    def status(self, *arguments):
        return subprocess.run([BIN / "carillon", "--server", self.address, *arguments, "status"],
                              capture_output=True, text=True, check=False, timeout=60)

    def test_the_command_line_talks_to_a_daemon_that_its_roots_vouch_for(self):
        done = self.status("--tls-roots", self.certificate)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_certificate_that_expires_soon_is_told_by_log_metrics_and_doctor(self):
        with urllib.request.urlopen(f"http://{self.metrics}/metrics", timeout=10) as answer:
            found = re.search(r"(?m)^carillon_tls_certificate_left_seconds (\S+)$", answer.read().decode())
        self.assertLess(86400, float(found[1]))
        self.assertLess(float(found[1]), 2 * 86400)
        doctor = subprocess.run([BIN / "carillon", "--server", self.address, "--tls-roots", self.certificate, "doctor"],
                                capture_output=True, text=True, check=False, timeout=60)
        self.assertRegex(doctor.stdout, "FAULT  expiry .* expires on 20..-..-.. ..:.. UTC.*reload the daemon")
        over_socket = self.daemon.command("doctor", check=False)
        self.assertRegex(over_socket.stdout, "ok +tls +the daemon serves TLS over TCP, and its Unix socket needs none")
        end_s = time.monotonic() + 30
        while "a certificate of the daemon expires in 1 days" not in (self.folder / "log").read_text():
            self.assertLess(time.monotonic(), end_s, (self.folder / "log").read_text())
            time.sleep(0.05)

    def test_the_doctor_finds_files_with_which_the_daemon_would_not_start_again(self):
        settings = r"(?m)^{} +settings +{}"
        good = self.daemon.command("doctor", check=False).stdout
        self.assertRegex(good, settings.format("ok", "a start would accept the settings and the files that they name$"))
        whole = self.key.read_bytes()
        for name, harm in (("truncated", lambda: self.key.write_bytes(whole[:100])),
                           ("open to all", lambda: self.key.chmod(0o666)),
                           ("removed", self.key.unlink)):
            with self.subTest(name=name):
                harm()
                done = self.daemon.command("doctor", check=False)
                self.assertEqual(done.returncode, 1)
                self.assertRegex(done.stdout, settings.format(
                    "FAULT", f"the daemon runs, but would not start again: TLS_UNUSABLE: .*{self.key.name}"))
                self.key.write_bytes(whole)
                self.key.chmod(0o600)

    def test_without_roots_it_says_that_the_daemon_may_want_tls(self):
        done = self.status()
        self.assertEqual(done.returncode, 3)
        self.assertRegex(done.stderr, "SERVER_UNAVAILABLE: .*closed the connection.*TLS.*--tls-roots")

    def test_roots_that_do_not_vouch_for_the_daemon_are_a_mistake_of_tls(self):
        other, _ = self_signed(self.folder, "other")
        done = self.status("--tls-roots", other)
        self.assertEqual(done.returncode, 3)
        self.assertRegex(done.stderr, "SERVER_UNAVAILABLE: TLS with .*failed.*certificate")


if __name__ == "__main__":
    unittest.main()
