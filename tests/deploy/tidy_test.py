# SPDX-License-Identifier: Apache-2.0
import contextlib
import io
import json
import os
import unittest

from tree import TreeTest
import check_tidy


class Tidy(TreeTest):
    def setUp(self):
        super().setUp()
        self.root = self.root.resolve()
        self.copy(".clang-tidy")
        os.environ["CARILLON_CACHE"] = str(self.root / "cache")
        self.write("server/a.h", "#pragma once\ninline int Twice(int x) { return 2 * x; }\n")
        self.write("server/a.cc", '#include "server/a.h"\nint Four() { return Twice(2); }\n')
        self.write("build/compile_commands.json", json.dumps([{
            "directory": str(self.root / "build"), "file": str(self.root / "server/a.cc"),
            "command": f"c++ -std=c++20 -I{self.root} -c {self.root}/server/a.cc"}]))

    def check(self):
        """The problems, and how many files were looked at."""
        with contextlib.redirect_stdout(io.StringIO()) as said:
            problems = list(check_tidy.check(self.root, self.root / "build"))
        return problems, int(said.getvalue().split()[0])

    def test_what_passed_once_is_not_checked_again(self):
        self.assertEqual(self.check(), ([], 1))
        self.assertEqual(self.check(), ([], 0))

    def test_a_changed_header_is_checked_with_what_includes_it(self):
        self.check()
        self.write("server/a.h", "#pragma once\ninline int twiceAsMuch(int x) { return 2 * x; }\n"
                   "inline int Twice(int x) { return twiceAsMuch(x); }\n")
        problems, count = self.check()
        self.assertEqual(count, 1)
        self.assert_found(problems, "invalid case style for function 'twiceAsMuch'")

    def test_a_use_after_move_is_found_every_time_until_mended(self):
        self.write("server/a.cc", """#include <string>
            #include <utility>
            std::string Join(std::string x) {
              std::string y = std::move(x);
              return x + y;
            }""")
        for _ in range(2):
            self.assert_found(self.check()[0], "[bugprone-use-after-move")


if __name__ == "__main__":
    unittest.main()
