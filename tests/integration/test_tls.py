# SPDX-License-Identifier: Apache-2.0
"""The daemon over TLS, with a certificate made here."""

import os

from certificates import self_signed
from daemon import ScratchTest, free_port, wait_until


class TlsTest(ScratchTest):
    def setUp(self):
        super().setUp()
        self.certificate, key = self_signed(self.folder)
        self.serve("--listen", "127.0.0.1:0", "--tls-certificate", self.certificate, "--tls-key", key, "--metrics",
                   f"127.0.0.1:{free_port()}")
        self.address = self.daemon.listening[1].split()[-1]

    def status(self, *arguments):
        return self.daemon.command(*arguments, "status", server=self.address, check=False, timeout=60)

    def test_the_command_line_talks_to_a_daemon_that_its_roots_vouch_for(self):
        done = self.status("--tls-roots", self.certificate)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_certificate_that_expires_soon_is_told_by_log_and_metrics(self):
        left_s = float(self.daemon.metrics()["carillon_tls_certificate_left_seconds"])
        self.assertTrue(86400 < left_s < 2 * 86400, left_s)
        wait_until(lambda: "a certificate of the daemon expires in 1 days" in self.daemon.log())

    def test_without_roots_it_says_that_the_daemon_may_want_tls(self):
        done = self.status()
        self.assertEqual(done.returncode, 3)
        self.assertRegex(done.stderr, "SERVER_UNAVAILABLE: .*closed the connection.*TLS.*--tls-roots")

    def test_roots_that_do_not_vouch_for_the_daemon_are_a_mistake_of_tls(self):
        other, _ = self_signed(self.folder, "other")
        done = self.status("--tls-roots", other)
        self.assertEqual(done.returncode, 3)
        self.assertRegex(done.stderr, "SERVER_UNAVAILABLE: TLS with .*failed.*certificate")


class PlaintextTest(ScratchTest):
    def setUp(self):
        super().setUp()
        self.serve("--listen", "127.0.0.1:0")
        self.port = self.daemon.listening[1].rpartition(":")[2].strip()

    def status(self, host, **variables):
        return self.daemon.command("status", server=f"{host}:{self.port}", check=False, timeout=60,
                                   env={**os.environ, **variables})

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
