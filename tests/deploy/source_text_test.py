# SPDX-License-Identifier: Apache-2.0
import unittest

from tree import TreeTest
import check_format
import check_scripts
import check_spdx

APACHE = "// SPDX-License-Identifier: Apache-2.0\n"
AGPL = "// SPDX-License-Identifier: AGPL-3.0-or-later\n"


class Licences(TreeTest):
    def test_the_right_licence_of_each_folder_passes(self):
        self.write("server/a.cc", APACHE)
        self.write("precompute/a.cc", AGPL)
        self.write("tests/precompute/a.cc", AGPL)
        self.write("deploy/a", "#!/usr/bin/env bash\n# SPDX-License-Identifier: Apache-2.0\n")
        self.assert_found(check_spdx.check(self.root))

    def test_a_wrong_or_missing_licence_is_found(self):
        self.write("server/a.cc", AGPL)
        self.write("precompute/a.cc", APACHE)
        self.write("client_sdk/a.py", "import this\n")
        self.assert_found(check_spdx.check(self.root), "server/a.cc:1", "precompute/a.cc:1",
                          "client_sdk/a.py:1")


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
