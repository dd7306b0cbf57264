# SPDX-License-Identifier: Apache-2.0
"""The client in Python, which is made of the .proto files alone, is heard at the right pitch."""

import re
import subprocess
import sys
import unittest
import wave

import meshes
from daemon import ROOT, DaemonTest


class PythonClientTest(DaemonTest):
    def test_strike_py_creates_strikes_and_hears_at_the_right_pitch(self):
        mesh, out = self.folder / "bar.obj", self.folder / "bar.wav"
        mesh.write_bytes(meshes.bar())
        printed = subprocess.run(
            [sys.executable, ROOT / "client_sdk/python/strike.py", mesh, "--server",
             self.daemon.server, "--material", meshes.MATERIAL, "--point", "0,0.008,0.01",
             "--impulse", "0,0,-0.02", "--duration", "0.001", "--seconds", "1.5", "--out", out],
            capture_output=True, text=True, check=True).stdout
        lowest = float(re.search(r"the lowest at ([0-9.]+) Hz", printed)[1])
        loudest = float(re.search(r"loudest at ([0-9.]+) Hz", printed)[1])
        peak = float(re.search(r"peak ([0-9.]+)", printed)[1])
        # Shear and rotary inertia, which the formula leaves out, lower a bar of this slenderness by
        # 1 %; the mesh raises it by less.
        self.assertLess(abs(lowest / meshes.bar_first_bending_hz() - 1), 0.02)
        # A contact of a millisecond leaves little but the first mode; 1.5 s resolve 0.7 Hz.
        self.assertLess(abs(loudest - lowest), 1)
        self.assertGreater(peak, 0.0001)
        with wave.open(str(out)) as sound:
            self.assertEqual(sound.getnframes(), 1.5 * sound.getframerate())

    def test_strike_py_says_why_it_is_refused(self):
        mesh = self.folder / "open.obj"
        mesh.write_bytes(meshes.obj([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]))
        refused = subprocess.run(
            [sys.executable, ROOT / "client_sdk/python/strike.py", mesh, "--server",
             self.daemon.server, "--point", "0,0,0", "--impulse", "0,0,1"],
            capture_output=True, text=True, check=False)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("strike.py: MESH_NOT_CLOSED: ", refused.stderr)


if __name__ == "__main__":
    unittest.main()
