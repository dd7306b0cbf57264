# SPDX-License-Identifier: Apache-2.0
"""The package for Node against the real daemon, by the tests of node_package.test.js."""

import pathlib
import subprocess
import unittest

import meshes
from daemon import DaemonTest
from node import node_environment


class NodePackageTest(DaemonTest):
    def test_the_tests_in_javascript_pass(self):
        bar = self.folder / "bar.obj"
        bar.write_bytes(meshes.bar())
        environment = {**node_environment(self.folder), "CARILLON_SERVER": self.daemon.server,
                       "CARILLON_TEST_BAR": str(bar),
                       "CARILLON_TEST_GLTF": str(meshes.gltf_with_buffer(meshes.BAR_SIZE, bar.parent)),
                       "CARILLON_TEST_MATERIAL": meshes.MATERIAL}
        done = subprocess.run(["node", "--test", pathlib.Path(__file__).with_name("node_package.test.js")],
                              env=environment, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("# fail 0", done.stdout.replace("ℹ", "#"))
        self.assertNotIn("# pass 0", done.stdout.replace("ℹ", "#"))


if __name__ == "__main__":
    unittest.main()
