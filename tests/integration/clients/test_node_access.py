# SPDX-License-Identifier: Apache-2.0
"""The package for Node over TLS: callers that show a token, a certificate, a wrong token, or nothing."""

import hashlib
import json
import pathlib
import subprocess
import tempfile
import unittest

from certificates import Authority
from daemon import Daemon
from node import node_environment

TOKEN = "a token for this test"
PROGRAM = """
const carillon = require('carillon');
(async () => {
  const c = carillon.connect(process.argv[1], JSON.parse(process.argv[2]));
  const scene = await c.createScene();
  await scene.delete();
  for await (const model of c.models()) throw new Error(model.name);
  c.close();
  console.log('done');
})().catch((error) => { console.log(error.reason ?? error.message); process.exit(1); });
"""


class NodeAccessTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="carillon-")))
        authority = Authority(self.folder)
        certificate, key = authority.issue("server")
        self.roots = {"tlsRoots": str(authority.certificate)}
        certificates = authority.issue("console", alternative="DNS:console.example.org")
        self.client_files = dict(zip(("tlsCertificate", "tlsKey"), map(str, certificates)))
        access = self.folder / "access"
        access.touch(0o600)
        access.write_text(f"robot strike,listen sha256:{hashlib.sha256(TOKEN.encode()).hexdigest()}\n"
                          "console strike,listen certificate:console.example.org\n")
        self.daemon = Daemon(self.folder, "--listen", "127.0.0.1:0", "--tls-certificate", certificate, "--tls-key", key,
                             "--tls-client-roots", authority.certificate, "--access-file", access)
        self.addCleanup(self.daemon.kill)
        self.address = self.daemon.listening[1].split()[-1]

    def run_program(self, options, **variables):
        return subprocess.run(["node", "-e", PROGRAM, self.address, json.dumps(options)], text=True, check=False,
                              timeout=60, env={**node_environment(self.folder), **variables},
                              stdout=subprocess.PIPE).stdout.strip()

    def test_a_caller_is_known_by_its_token_or_its_certificate(self):
        for options, variables in (({**self.roots, "token": TOKEN}, {}), (self.roots, {"CARILLON_TOKEN": TOKEN}),
                                   ({**self.roots, **self.client_files}, {}),
                                   ({**self.roots, "token": TOKEN}, {"CARILLON_TOKEN": "another"})):
            with self.subTest(options=options, variables=variables):
                self.assertEqual(self.run_program(options, **variables), "done")

    def test_others_are_refused(self):
        self.assertEqual(self.run_program(self.roots), "CREDENTIAL_MISSING")
        self.assertEqual(self.run_program({**self.roots, "token": "guessed"}), "TOKEN_WRONG")

    def test_a_proxy_for_the_network_is_not_asked_for_this_machine(self):
        self.assertEqual(self.run_program({**self.roots, "token": TOKEN}, http_proxy="http://127.0.0.1:1", no_proxy="",
                                          no_grpc_proxy=""), "done")

    def test_options_that_do_not_fit_together_are_named(self):
        self.assertIn("tlsKey", self.run_program({**self.roots, "tlsCertificate": "client.pem"}))
        self.assertIn("tlsRoots", self.run_program(self.client_files))


if __name__ == "__main__":
    unittest.main()
