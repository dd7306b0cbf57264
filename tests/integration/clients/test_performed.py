# SPDX-License-Identifier: Apache-2.0
"""The client for C++ performs environments in step, and gets the same samples as the package for Python."""

import json
import os
import pathlib
import subprocess
import unittest

import numpy

import carillon
import meshes
from daemon import DaemonTest
from performed import STEPS_BEFORE, Performed

PROGRAM = pathlib.Path(os.environ["CARILLON_BUILD_DIR"]) / "tests/performed"


class PerformedTest(DaemonTest):
    def test_the_same_bits_in_two_languages(self):
        samples = self.folder / "samples"
        with carillon.connect(self.daemon.server) as c:
            model = c.create_model(meshes.box(meshes.BAR_SIZE), meshes.MATERIAL, without_transfer=True)
            performed = Performed(c, model, environments=3, bodies=2, step_s=1 / 90)
            with performed.sound:
                expected = [performed.step(number).tobytes() for number in range(STEPS_BEFORE)]
            words = [PROGRAM, self.daemon.server, model.name, "3", "2", repr(1 / 90), "0.1", samples]
            printed = subprocess.run(words, check=True, stdout=subprocess.PIPE).stdout
            found = json.loads(printed.splitlines()[-1])
        self.assertGreater(abs(numpy.frombuffer(b"".join(expected), numpy.float32)).max(), 0.01)
        self.assertEqual(samples.read_bytes(), b"".join(expected))
        self.assertGreater(found["steps"], 0)


if __name__ == "__main__":
    unittest.main()
