# SPDX-License-Identifier: Apache-2.0
import contextlib
import io
import json
import os
import pathlib
import unittest

from tree import TreeTest
import check_tidy
import compilation


class Tidy(TreeTest):
    def setUp(self):
        super().setUp()
        self.root = self.root.resolve()
        self.copy(".clang-tidy")
        os.environ["CARILLON_CACHE"] = str(self.root / "cache")
        self.write("server/a.h", "#pragma once\ninline int Twice(int x) { return 2 * x; }\n")
        self.write("server/a.cc", '#include "server/a.h"\nint Four() { return Twice(2); }\n')
        self.compile("server/a.cc")

    def compile(self, *names):
        """Makes the compilation database of a build that compiles the files of these names."""
        self.write("build/compile_commands.json", json.dumps([{
            "directory": str(self.root / "build"), "file": str(self.root / name),
            "command": f"c++ -std=c++20 -I{self.root} -c {self.root / name}"} for name in names]))

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

    def test_of_files_read_together_the_one_at_fault_is_named_and_checked_again(self):
        self.compile("server/a.cc", "server/b.cc")
        self.write("server/b.cc", "int badlyNamed() { return 5; }\n")
        problems, count = self.check()
        self.assertEqual(count, 2)
        self.assert_found(problems, "server/b.cc:1:5: error: invalid case style for function 'badlyNamed'")
        self.assertEqual(self.check()[1], 1)

    def test_files_that_define_the_same_name_pass(self):
        self.compile("server/a.cc", "server/b.cc")
        for name in "ab":
            self.write(f"server/{name}.cc",
                       f"static int Same() {{ return 1; }}\nint Of{name.upper()}() {{ return Same(); }}\n")
        self.assertEqual(self.check(), ([], 2))
        self.assertEqual(self.check(), ([], 0))

    def test_the_files_of_a_file_that_the_build_made_of_several_are_checked(self):
        self.write("server/b.cc", "int badlyNamed() { return 5; }\n")
        self.write("build/x.dir/Unity/unity_0.cxx", "".join(f'#include "{self.root}/server/{x}.cc"\n' for x in "ab"))
        self.compile("build/x.dir/Unity/unity_0.cxx")
        problems, count = self.check()
        self.assertEqual(count, 2)
        self.assert_found(problems, "badlyNamed")


class Batches(TreeTest):
    def batches(self, **texts):
        for name, text in texts.items():
            self.write(f"server/{name}.cc", text)
        sources = [compilation.Source(f"server/{name}.cc", ("-O1",)) for name in texts]
        return [[pathlib.Path(source.name).stem for source in batch]
                for batch in compilation.batches(self.root, sources)]

    def test_files_whose_own_names_clash_are_apart(self):
        own = "namespace {\nconstexpr double kStep = 1;\n}  // namespace\n"
        self.assertEqual(self.batches(a=own, b="int F();\n", c=own), [["b", "a"], ["c"]])

    def test_files_of_two_programs_are_apart(self):
        self.assertEqual(self.batches(a="int main() {}\n", b="int main(int, char**) {}\n"), [["a"], ["b"]])

    def test_files_with_other_folders_and_macros_are_together_unless_a_macro_has_two_values(self):
        def compiled(*words):
            return compilation.Source(f"server/{words[-1][-1]}.cc", ("-std=c++20", *words[:-1]))

        given = [compiled("-I/x", "-DTEXT=\"x\"", "a"), compiled("-isystem", "/y", "-DTEXT=\"y\"", "-DN=1", "b"),
                 compiled("-DN=2", "c")]
        for source in given:
            self.write(source.name, "")
        found = compilation.batches(self.root, given)
        self.assertEqual([[source.name for source in batch] for batch in found],
                         [["server/b.cc", "server/a.cc"], ["server/c.cc"]])
        self.assertEqual(compilation.arguments(found[0]),
                         ["-std=c++20", "-DTEXT=\"y\"", "-DN=1", "-isystem", "/y", "-I/x"])

    def test_a_file_that_includes_itself_is_alone(self):
        self.assertEqual(self.batches(a="", ring_kernel="", z=""), [["z", "a"], ["ring_kernel"]])


if __name__ == "__main__":
    unittest.main()
