# SPDX-License-Identifier: Apache-2.0
"""The daemon over TLS, with a certificate made here."""

import os
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

    def test_a_certificate_that_expires_soon_is_told_by_log_and_metrics(self):
        with urllib.request.urlopen(f"http://{self.metrics}/metrics", timeout=10) as answer:
            found = re.search(r"(?m)^carillon_tls_certificate_left_seconds (\S+)$", answer.read().decode())
        self.assertLess(86400, float(found[1]))
        self.assertLess(float(found[1]), 2 * 86400)
        end_s = time.monotonic() + 30
        while "a certificate of the daemon expires in 1 days" not in (self.folder / "log").read_text():
            self.assertLess(time.monotonic(), end_s, (self.folder / "log").read_text())
            time.sleep(0.05)

    def test_without_roots_it_says_that_the_daemon_may_want_tls(self):
        done = self.status()
        self.assertEqual(done.returncode, 3)
        self.assertRegex(done.stderr, "SERVER_UNAVAILABLE: .*closed the connection.*TLS.*--tls-roots")

    def test_roots_that_do_not_vouch_for_the_daemon_are_a_mistake_of_tls(self):
        other, _ = self_signed(self.folder, "other")
        done = self.status("--tls-roots", other)
        self.assertEqual(done.returncode, 3)
        self.assertRegex(done.stderr, "SERVER_UNAVAILABLE: TLS with .*failed.*certificate")


class PlaintextTest(unittest.TestCase):
    def setUp(self):
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="carillon-")))
        self.daemon = Daemon(folder, "--listen", "127.0.0.1:0")
        self.addCleanup(self.daemon.stop)
        self.port = self.daemon.listening[1].rpartition(":")[2].strip()

    def status(self, host, **variables):
        return subprocess.run([BIN / "carillon", "--server", f"{host}:{self.port}", "status"], capture_output=True,
                              text=True, check=False, timeout=60, env={**os.environ, **variables})

    def test_a_token_is_not_sent_without_tls_to_an_address_that_may_be_of_another_machine(self):
        # This address leads to the daemon, too, but only the kernel knows that.
        refused = self.status("0.0.0.0", CARILLON_TOKEN="secret")
        self.assertEqual((refused.returncode, refused.stdout), (1, ""))
        self.assertRegex(refused.stderr, "^carillon: TLS_REQUIRED: ")
        self.assertEqual(self.status("0.0.0.0").returncode, 0)

    def test_a_token_may_go_to_this_machine(self):
        # The daemon has no access file, and says so only to who has shown a token.
        told = self.status("127.0.0.1", CARILLON_TOKEN="secret")
        self.assertRegex(told.stderr, "^carillon: TOKEN_WRONG: ")

    def test_a_proxy_for_the_network_is_not_asked_for_this_machine(self):
        # Nobody listens at the port of the proxy.
        told = self.status("127.0.0.1", http_proxy="http://127.0.0.1:1", no_proxy="")
        self.assertEqual((told.returncode, told.stderr), (0, ""))


if __name__ == "__main__":
    unittest.main()
