# SPDX-License-Identifier: Apache-2.0
"""The adapters in JavaScript with their engines, by the tests of adapters.test.js."""

import os
import pathlib
import subprocess
import unittest

HERE = pathlib.Path(__file__).resolve().parent


class JavascriptAdaptersTest(unittest.TestCase):
    def test_the_tests_in_javascript_pass(self):
        environment = {**os.environ, "NODE_PATH": os.environ["CARILLON_ENGINE_MODULES"]}
        done = subprocess.run(["node", "--test", HERE / "adapters.test.js"], env=environment, check=False,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertNotIn("# pass 0", done.stdout.replace("ℹ", "#"))
