# SPDX-License-Identifier: Apache-2.0
"""A stream of the C++ client survives its daemon: it registers its scene again after a restart and after a kill."""

import os
import pathlib
import subprocess
import tempfile
import unittest

import carillon
import meshes
from daemon import Daemon

PROGRAM = pathlib.Path(os.environ["CARILLON_BUILD_DIR"]) / "tests/lasting_stream"


class LastingStreamTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        self.addCleanup(scratch.cleanup)
        self.daemon = Daemon(scratch.name)
        self.addCleanup(lambda: self.daemon.stop())
        with carillon.connect(self.daemon.server) as c:
            self.model = c.create_model(meshes.box(meshes.BAR_SIZE), meshes.MATERIAL, label="bar").name

    def read_until(self, program, condition):
        """Reads pairs of numbers until one fulfils the condition; returns it."""
        for line in program.stdout:
            accepted, dropped = map(int, line.split())
            if condition(accepted, dropped):
                return accepted, dropped
        raise AssertionError("the program has ended")

    def test_a_simulation_goes_on_while_its_daemon_is_restarted(self):
        with subprocess.Popen([PROGRAM, self.daemon.server, self.model], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                              text=True) as program:
            self.addCleanup(program.kill)
            before = 0
            for end in (self.daemon.stop, self.daemon.kill):
                _, dropped = self.read_until(program, lambda accepted, _: accepted > 20)
                self.assertEqual(dropped, before)
                end()
                self.read_until(program, lambda _, dropped, before=before: dropped > before + 20)
                self.daemon.start()
                # The counts of the new stream begin at zero.
                self.read_until(program, lambda accepted, _: accepted < 20)
                _, before = self.read_until(program, lambda accepted, _: accepted > 40)
                with carillon.connect(self.daemon.server) as c:
                    (scene,) = c.scenes()
                    self.assertEqual(scene.name, "scenes/lathe")
                    self.assertEqual([item.handle for item in scene.objects()], [5])
            said, _ = program.communicate()
            self.assertEqual(program.returncode, 0, said)


if __name__ == "__main__":
    unittest.main()
