# SPDX-License-Identifier: Apache-2.0
import unittest

from tree import TreeTest
import check_style


def lines(count, text="  x();\n"):
    return text * count


class Style(TreeTest):
    def setUp(self):
        super().setUp()
        self.write("deploy/lint/style_exceptions.toml", "")

    def check(self):
        return list(check_style.check(self.root))

    def test_limits_may_be_reached(self):
        self.write("server/a.cc", "void F(int a, std::map<int, int> b, int c, int d, int e) {\n" + lines(38) + "}\n")
        self.write("deploy/a.py", "def f(a, b, c, d, e):\n" + lines(39, "    pass\n") + "#" * 120 + "\n")
        self.assert_found(self.check())

    def test_a_long_function_is_found_in_each_language(self):
        self.write("server/a.cc", "namespace {\nint A::F() const {\n" + lines(39) + "}\n}\n")
        self.write("deploy/a.py", "def f():\n" + lines(40, "    pass\n"))
        self.write("deploy/a.sh", "f() {\n" + lines(39) + "}\n")
        self.assert_found(self.check(), "server/a.cc:2: A::F has 41 lines", "deploy/a.py:1: f has 41 lines",
                          "deploy/a.sh:1: f has 41 lines")

    def test_six_parameters_are_found_over_several_lines_and_in_members(self):
        self.write("server/a.h", "class A {\n public:\n  A(int a, int b, int c,\n    int d, int e, int f) : a_(a) {\n"
                   "    x();\n  }\n};\n")
        self.write("deploy/a.py", "class A:\n    def f(self, a, b, c, d, e, f):\n        pass\n")
        self.assert_found(self.check(), "server/a.h:3: A has 6 parameters", "deploy/a.py:2: f has 6 parameters")

    def test_what_only_looks_like_a_function_is_none(self):
        body = lines(50, "    x();\n")
        self.write("server/a.cc", "class A {\n" + lines(50, "  int x;\n") + "};\nconst T t(1);\n"
                   "void F() {\n  if (a(1, 2, 3, 4, 5, 6)) {\n    x();\n  }\n}\n"
                   "const std::vector<F<void(int)>> list = {\n" + body + "};\n")
        self.assert_found(self.check())

    def test_a_long_file_and_a_long_line_are_found(self):
        self.write("server/a.h", "\n" * 401)
        self.write("README.md", "a" * 121 + "\n| " + "a" * 121 + "\nhttps://" + "a" * 121 + "\n")
        self.assert_found(self.check(), "README.md:1: 121 columns", "server/a.h:401: 401 lines")

    def test_an_exception_holds_for_its_function_alone(self):
        self.write("server/a.cc", "void F() {\n" + lines(40) + "}\nvoid G() {\n" + lines(40) + "}\n")
        self.write("deploy/lint/style_exceptions.toml", '[function_lines]\n"server/*.cc F" = "reason"\n')
        self.assert_found(self.check(), "server/a.cc:43: G has 42 lines")


if __name__ == "__main__":
    unittest.main()
