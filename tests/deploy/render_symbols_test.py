#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What deploy/lint/check_render_symbols.py finds in archives with planted mistakes."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

CHECKER = pathlib.Path(__file__).resolve().parents[2] / "deploy/lint/check_render_symbols.py"
CLEAN = """
#include <cmath>
namespace carillon {
__attribute__((noinline)) static float Square(float x) { return std::sqrt(x * x + 1); }
struct Mixer { float Render(float x); };
float Mixer::Render(float x) { return Square(x); }
}
"""


def problems_in(text):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "mixer.cc").write_text(text, encoding="ascii")
        subprocess.run(["g++", "-std=c++20", "-O1", "-fno-inline", "-c", "mixer.cc"], cwd=folder, check=True)
        subprocess.run(["ar", "rcs", "room.a", "mixer.o"], cwd=folder, check=True)
        run = subprocess.run([sys.executable, "-B", CHECKER, folder / "room.a"], capture_output=True, text=True)
        return run.stdout if run.returncode else ""


class RenderSymbols(unittest.TestCase):
    def test_arithmetic_passes(self):
        self.assertEqual(problems_in(CLEAN), "")

    def test_an_allocation_behind_a_local_function_is_found(self):
        found = problems_in(CLEAN.replace(
            "return std::sqrt(x * x + 1);", "static float* volatile kept; kept = new float(x); return *kept;"))
        self.assertIn("operator new", found)
        self.assertIn("<- carillon::Mixer::Render", found)

    def test_a_lock_is_found(self):
        found = problems_in("#include <mutex>\nstatic std::mutex mutex;\n" +
                            CLEAN.replace("return Square(x);", "const std::lock_guard lock(mutex); return x;"))
        self.assertIn("pthread_mutex_lock", found)

    def test_a_system_call_behind_a_table_of_pointers_is_found(self):
        found = problems_in("#include <unistd.h>\n" + CLEAN.replace(
            "struct Mixer", "static float Ask(float x) { return x + getppid(); }\n"
            "using Kernel = float (*)(float);\nextern const Kernel kKernels[2];\n"
            "const Kernel kKernels[2] = {Square, Ask};\nstruct Mixer").replace(
                "return Square(x);", "return kKernels[x > 0](x);"))
        self.assertIn("getppid", found)

    def test_what_render_does_not_reach_may_allocate(self):
        self.assertEqual(problems_in(CLEAN + "float* Make() { return new float(1); }\n"), "")

    def test_an_archive_without_the_root_is_a_problem(self):
        self.assertIn("no function matches", problems_in("int x() { return 1; }\n"))


if __name__ == "__main__":
    unittest.main()
