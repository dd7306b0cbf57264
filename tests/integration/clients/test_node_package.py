# SPDX-License-Identifier: Apache-2.0
"""The package for Node against the real daemon, by the tests of node_package.test.js, and over TLS: callers that show a
token, a certificate, a wrong token, or nothing."""

import json
import pathlib
import subprocess

import numpy

import gltf
import meshes
from certificates import SecuredTest, access_line
from daemon import DaemonTest, node_environment

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


class NodePackageTest(DaemonTest):
    def write_gltf(self):
        """The bar as a file box.gltf, whose data are in the file box.bin."""
        vertices, faces = meshes.box(meshes.BAR_SIZE)
        writer = gltf.Writer()
        bar = {"attributes": {"POSITION": writer.add(numpy.array(vertices))},
               "indices": writer.add(numpy.array(faces, numpy.uint16).ravel())}
        (self.folder / "box.bin").write_bytes(writer.buffer)
        (self.folder / "box.gltf").write_text(json.dumps({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [bar]}], "accessors": writer.accessors, "bufferViews": writer.views,
            "buffers": [{"byteLength": len(writer.buffer), "uri": "box.bin"}]}))
        return str(self.folder / "box.gltf")

    def test_the_tests_in_javascript_pass(self):
        bar = self.folder / "bar.obj"
        bar.write_bytes(meshes.bar())
        environment = {**node_environment(self.folder), "CARILLON_SERVER": self.daemon.server,
                       "CARILLON_TEST_BAR": str(bar),
                       "CARILLON_TEST_GLTF": self.write_gltf(), "CARILLON_TEST_MATERIAL": meshes.MATERIAL}
        done = subprocess.run(["node", "--test", pathlib.Path(__file__).with_name("node_package.test.js")],
                              env=environment, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("# fail 0", done.stdout.replace("ℹ", "#"))
        self.assertNotIn("# pass 0", done.stdout.replace("ℹ", "#"))


class NodeAccessTest(SecuredTest):
    def setUp(self):
        super().setUp()
        self.roots = {"tlsRoots": str(self.authority.certificate)}
        certificates = self.authority.issue("console", alternative="DNS:console.example.org")
        self.client_files = dict(zip(("tlsCertificate", "tlsKey"), map(str, certificates)))
        self.serve_secured(access_line("robot", "strike,listen", TOKEN),
                           "console strike,listen certificate:console.example.org\n")

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
