# SPDX-License-Identifier: Apache-2.0
"""The recipes of docs/: each page's program, compiled as the page says, lets a bar fall into a real daemon."""

import os
import pathlib
import re
import subprocess
import unittest

import carillon
from daemon import BIN, ROOT, DaemonTest

BUILD = pathlib.Path(os.environ["CARILLON_BUILD_DIR"])
MOST_LINES = 60


class RecipesTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        prefix = cls.folder / "prefix"
        subprocess.run(["cmake", "--install", BUILD, "--component", "sdk", "--prefix", prefix], check=True,
                       stdout=subprocess.DEVNULL)
        cls.include, cls.library = prefix / "include", next(prefix.rglob("libcarillon.so")).parent
        subprocess.run([BIN / "carillon", "example", "bar"], cwd=cls.folder, check=True, stdout=subprocess.DEVNULL)
        cls.environment = {**os.environ, "CARILLON_SERVER": cls.daemon.server, "LD_LIBRARY_PATH": str(cls.library)}

    def save(self, page, language, name):
        program = re.search(rf"(?ms)^```{language}\n(.*?)^```", (ROOT / "docs" / page).read_text())[1]
        self.assertLessEqual(program.count("\n"), MOST_LINES)
        (self.folder / name).write_text(program)
        return name

    def compile(self, *words):
        done = subprocess.run(words, cwd=self.folder, check=False, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def hear_the_bar(self, *words):
        """The bar falls, meets the floor once, and lies there in silence."""
        with carillon.connect(self.daemon.server) as c, c.recording() as heard:
            done = subprocess.run([*words, "bar.obj"], cwd=self.folder, env=self.environment, check=False,
                                  capture_output=True, text=True)
            heard.take(0.5)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(done.stdout, "1 blows sounded, 0 contacts were rejected\n")
        self.assertGreater(heard.sound.peak, 1e-4)
        wrong = subprocess.run([*words, "none.obj"], cwd=self.folder, env=self.environment, check=False,
                               capture_output=True, text=True)
        self.assertNotEqual(wrong.returncode, 0)
        self.assertIn("FILE_NOT_FOUND", wrong.stdout + wrong.stderr)

    def test_unity(self):
        self.compile("mcs", self.save("recipe_unity.md", "csharp", "Fall.cs"))
        self.hear_the_bar("mono", "Fall.exe")

    def test_rust(self):
        # Debian's compiler, not one that a user has beside it.
        self.compile("/usr/bin/rustc", "-O", "-L", self.library, self.save("recipe_rust.md", "rust", "fall.rs"),
                     "-o", "fall_rust")
        self.hear_the_bar("./fall_rust")

    def test_unreal(self):
        self.compile("g++", "-std=c++17", "-fno-exceptions", "-fno-rtti", "-Wall", "-Wextra", "-Werror",
                     self.save("recipe_unreal.md", "cpp", "fall.cpp"), "-o", "fall_unreal", f"-I{self.include}",
                     f"-L{self.library}", "-lcarillon")
        self.hear_the_bar("./fall_unreal")


if __name__ == "__main__":
    unittest.main()
