#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What deploy/lint/check_thread_roles.py finds in files with planted mistakes."""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("CARILLON_BUILD", ROOT / "build/release"))


def problems_in(body):
    text = ('#include "server/synthesis/mixer.h"\nnamespace carillon {\nstruct Planted {\n  Mutex mutex;\n'
            "  int guarded ABSL_GUARDED_BY(mutex) = 0;\n  Mixer& mixer;\n  OscillatorBank& bank;\n  BlockMix& mix;\n"
            f"  void Run() {body}\n}};\n}}  // namespace carillon\n")
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "planted.cc"
        path.write_text(text, encoding="ascii")
        run = subprocess.run([sys.executable, "-B", ROOT / "deploy/lint/check_thread_roles.py", BUILD, path],
                             capture_output=True, text=True, check=False)
        return run.stdout if run.returncode else ""


class ThreadRoles(unittest.TestCase):
    def test_rendering_in_the_role_passes(self):
        self.assertEqual(problems_in("{ const InRole role(kRenderRole); bank.RenderAdd(mix); }"), "")

    def test_rendering_without_the_role_is_found(self):
        self.assertIn("kRenderRole", problems_in("{ bank.RenderAdd(mix); }"))

    def test_a_lock_taken_while_rendering_is_found(self):
        found = problems_in("{ const InRole role(kRenderRole); const MutexLock lock(&mutex); }")
        self.assertIn("kRenderRole", found)

    def test_control_called_while_rendering_is_found(self):
        found = problems_in("{ const InRole role(kRenderRole); mixer.CollectGarbage(); }")
        self.assertIn("CollectGarbage", found)

    def test_a_guarded_member_without_its_lock_is_found(self):
        self.assertIn("guarded", problems_in("{ guarded = 1; }"))


if __name__ == "__main__":
    unittest.main()
