# SPDX-License-Identifier: Apache-2.0
"""One scene by every SDK: its trace has the same bytes, and its offline rendering the same samples, bit for bit."""

import pathlib
import subprocess
import sys
import unittest

import numpy

import carillon
import meshes
from daemon import DaemonTest
from node import BUILD, node_environment

HERE = pathlib.Path(__file__).parent / "golden"


class GoldenSceneTest(DaemonTest):
    def test_every_sdk_writes_the_same_trace_and_hears_the_same_samples(self):
        with carillon.connect(self.daemon.server) as c:
            model = c.create_model(meshes.box(meshes.BAR_SIZE), meshes.MATERIAL).name
        programs = {"C++": [BUILD / "tests/golden_scene"], "Python": [sys.executable, HERE / "golden.py"],
                    "Node": ["node", HERE / "golden.js"]}
        made = {}
        for name, words in programs.items():
            files = self.folder / f"{name}.contacts", self.folder / f"{name}.f32"
            subprocess.run([*words, self.daemon.server, model, *files], check=True,
                           env=node_environment(self.folder))
            made[name] = [file.read_bytes() for file in files]
        samples = numpy.frombuffer(made["C++"][1], "<f4")
        self.assertGreater(numpy.abs(samples).max(), 1e-3)
        self.assertGreater(len(samples), 2 * 48000)
        for name, (trace, sound) in made.items():
            self.assertEqual(trace, made["C++"][0], f"the trace of {name} differs from that of C++")
            self.assertEqual(sound, made["C++"][1], f"the sound of {name} differs from that of C++")


if __name__ == "__main__":
    unittest.main()
