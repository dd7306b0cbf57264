# SPDX-License-Identifier: Apache-2.0
import unittest

from tree import TreeTest
import check_format
import check_scripts


class Format(TreeTest):
    def setUp(self):
        super().setUp()
        self.copy(".clang-format")

    def test_formatted_code_passes(self):
        self.write("server/a.cc", "int Twice(int x) { return 2 * x; }\n")
        self.assert_found(check_format.check(self.root))

    def test_badly_formatted_code_is_found(self):
        self.write("server/a.cc", "int Twice( int x ) { return 2*x; }\n")
        problems = list(check_format.check(self.root))
        self.assertTrue(problems)
        self.assertIn("server/a.cc:1", problems[0])


class Scripts(TreeTest):
    def test_a_quoted_variable_passes(self):
        self.write("deploy/a.sh", '#!/bin/bash\ntouch "$1"\n')
        self.assert_found(check_scripts.check(self.root))

    def test_an_unquoted_variable_is_found_in_a_script_without_suffix(self):
        self.write(".ci/run", "#!/usr/bin/env bash\ntouch $1\n")
        self.assert_found(check_scripts.check(self.root), "SC2086")


if __name__ == "__main__":
    unittest.main()
