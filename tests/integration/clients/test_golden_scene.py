# SPDX-License-Identifier: Apache-2.0
"""One scene by every SDK: its trace has the same bytes, and its offline rendering the same samples, bit for bit; so do
the steps of environments that are performed."""

import json
import pathlib
import subprocess
import sys

import numpy

import meshes
from daemon import BUILD, DaemonTest, node_environment
from performed import STEPS_BEFORE, Performed

HERE = pathlib.Path(__file__).parent / "golden"


class GoldenSceneTest(DaemonTest):
    def test_every_sdk_writes_the_same_trace_and_hears_the_same_samples(self):
        model = self.c.create_model(meshes.box(meshes.BAR_SIZE), meshes.MATERIAL).name
        programs = {"C++": [BUILD / "tests/golden_scene"], "Python": [sys.executable, HERE / "golden.py"],
                    "Node": ["node", HERE / "golden.js"]}
        made = {}
        for name, words in programs.items():
            files = self.folder / f"{name}.contacts", self.folder / f"{name}.f32"
            subprocess.run([*words, self.daemon.server, model, *files], check=True, env=node_environment(self.folder))
            made[name] = [file.read_bytes() for file in files]
        samples = numpy.frombuffer(made["C++"][1], "<f4")
        self.assertGreater(numpy.abs(samples).max(), 1e-4)
        # The steps to 0.25 s, a pause of a step, the rest in slow motion, and the tail.
        self.assertAlmostEqual(len(samples) / 2 / 48000, 0.25 + 1 / 64 + (0.25 + 1 / 128) / 0.5 + 0.5, delta=0.005)
        for name, (trace, sound) in made.items():
            self.assertEqual(trace, made["C++"][0], f"the trace of {name} differs from that of C++")
            self.assertEqual(sound, made["C++"][1], f"the sound of {name} differs from that of C++")

    def test_equal_arrays_are_equal_files_in_every_sdk(self):
        vertices = [[0, -0.0, 1e-5], [1 / 3, 1e-7, 0.1], [123456789.125, 1e16, 2 ** -25], [-1.5e-300, 1e22, 5e-324],
                    [0.0001, 9.999e-5, 1e15]]
        triangles = [[0, 1, 2], [0, 2, 3], [4, 2, 1]]
        script = (f"require('carillon').connect({json.dumps(self.daemon.server)}).upload("
                  f"{json.dumps({'vertices': vertices, 'triangles': triangles})}).then((digest) => "
                  "{ process.stdout.write(digest); process.exit(0); });")
        script = script.replace('-0.0', '-0')
        node = subprocess.run(["node", "-e", script], check=True, env=node_environment(self.folder),
                              capture_output=True, text=True).stdout
        self.assertEqual(self.c.upload((numpy.array(vertices), numpy.array(triangles))), node)

    def test_environments_are_performed_with_the_same_bits_in_two_languages(self):
        samples = self.folder / "samples"
        model = self.c.create_model(meshes.box(meshes.BAR_SIZE), meshes.MATERIAL, without_transfer=True)
        performed = Performed(self.c, model, environments=3, bodies=2, step_s=1 / 90)
        with performed.sound:
            expected = [performed.step(number).tobytes() for number in range(STEPS_BEFORE)]
        words = [BUILD / "tests/performed", self.daemon.server, model.name, "3", "2", repr(1 / 90), "0.1", samples]
        printed = subprocess.run(words, check=True, stdout=subprocess.PIPE).stdout
        found = json.loads(printed.splitlines()[-1])
        self.assertGreater(abs(numpy.frombuffer(b"".join(expected), numpy.float32)).max(), 0.01)
        self.assertEqual(samples.read_bytes(), b"".join(expected))
        self.assertGreater(found["steps"], 0)
