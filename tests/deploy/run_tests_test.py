# SPDX-License-Identifier: Apache-2.0
"""deploy/run_tests.py on a project of scripts that fail or skip once, or always."""

import subprocess
import sys
import unittest

from tree import ROOT, TreeTest

# Each script counts its runs in a file beside it; 4 is CTest's code of a skipped test.
PROJECT = """cmake_minimum_required(VERSION 3.25)
project(scripts NONE)
enable_testing()
foreach(name IN ITEMS good busy shy bad)
  add_test(NAME "room/${name}(1)" COMMAND /bin/sh ${CMAKE_CURRENT_SOURCE_DIR}/${name}.sh)
  set_tests_properties("room/${name}(1)" PROPERTIES SKIP_RETURN_CODE 4)
endforeach()
"""
FIRST_TIME = 'echo x >> "$0.runs"; [ $(wc -l < "$0.runs") -gt 1 ] && exit 0\n'


class RunTests(TreeTest):
    def setUp(self):
        super().setUp()
        self.write("CMakeLists.txt", PROJECT)
        for name, script in (("good", "exit 0"), ("busy", FIRST_TIME + "exit 1"), ("shy", FIRST_TIME + "exit 4"),
                             ("bad", "exit 1")):
            self.write(f"{name}.sh", script)
        self.build = self.root / "build"
        subprocess.run(["cmake", "-S", self.root, "-B", self.build], check=True, capture_output=True)

    def run_tests(self, *arguments):
        """The exit code, and the last lines that were printed."""
        done = subprocess.run([sys.executable, ROOT / "deploy/run_tests.py", self.build, *arguments], cwd=self.build,
                              capture_output=True, text=True, check=False)
        return done.returncode, done.stdout.splitlines()

    def test_what_passes_alone_is_no_failure_and_the_summary_names_it(self):
        code, lines = self.run_tests("--exclude-regex", "bad")
        self.assertEqual((code, lines[-2:]), (0, [
            "2 run again alone: room/busy(1), room/shy(1)", "100% tests passed, 0 tests failed out of 3"]))

    def test_what_fails_again_is_a_failure(self):
        code, lines = self.run_tests()
        self.assertEqual((code, lines[-3:]), (1, [
            "3 run again alone: room/bad(1), room/busy(1), room/shy(1)", "1 FAILED: room/bad(1)",
            "75% tests passed, 1 tests failed out of 4"]))

    def test_what_is_skipped_again_is_named(self):
        self.write("shy.sh", "exit 4")
        code, lines = self.run_tests("--tests-regex", "shy")
        self.assertEqual((code, lines[-2]), (0, "1 skipped: room/shy(1)"))

    def test_the_time_of_each_room_is_printed(self):
        _, lines = self.run_tests("--tests-regex", "good")
        self.assertRegex(lines[-2], r"^seconds of each room: room \d+$")

    def test_no_test_at_all_is_a_failure(self):
        self.assertNotEqual(self.run_tests("--tests-regex", "nothing")[0], 0)


if __name__ == "__main__":
    unittest.main()
