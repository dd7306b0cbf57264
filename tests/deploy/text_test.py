# SPDX-License-Identifier: Apache-2.0
import unittest

from tree import TreeTest
import check_text

APACHE = "// SPDX-License-Identifier: Apache-2.0\n"
AGPL = "// SPDX-License-Identifier: AGPL-3.0-or-later\n"
ROOMS = """
system_headers = []
[holds]
"server/base" = "clocks"
"deploy" = "scripts"
[rooms]
"server/base" = ["proto/*"]
[targets]
[libraries.xxhash]
headers = ["xxhash.h"]
files = ["server/base/xxh3.cc"]
"""
ROW = "| server/base | clocks | `proto/*` | xxhash |"


class Text(TreeTest):
    def test_the_right_licence_of_each_folder_passes(self):
        self.write("server/a.cc", APACHE)
        self.write("precompute/a.cc", AGPL)
        self.write("tests/precompute/a.cc", AGPL)
        self.write("deploy/a", "#!/usr/bin/env bash\n# SPDX-License-Identifier: Apache-2.0\n")
        self.assert_found(check_text.check_lines(self.root))

    def test_a_wrong_or_missing_licence_is_found(self):
        self.write("server/a.cc", AGPL)
        self.write("precompute/a.cc", APACHE)
        self.write("client_sdk/a.py", "import this\n")
        self.assert_found(check_text.check_lines(self.root), "server/a.cc:1", "precompute/a.cc:1", "client_sdk/a.py:1")

    def test_a_long_line_is_found_unless_it_cannot_be_broken(self):
        self.write("README.md", "a" * 121 + "\n| " + "a" * 121 + "\nhttps://" + "a" * 121 + "\n")
        self.assert_found(check_text.check_lines(self.root), "README.md:1: 121 columns")

    def test_a_misspelt_word_is_found_and_a_right_one_is_not(self):
        self.write("docs/a.md", "It is " + "rec" + "ieved, and swings to and fro.\n")
        self.assert_found(check_text.check_spelling(self.root), "received")


class RoomTable(TreeTest):
    def setUp(self):
        super().setUp()
        self.write("deploy/lint/rooms.toml", ROOMS)
        self.write("server/base/xxh3.cc", "")
        self.write("ARCHITECTURE.md", f"# Page\n{check_text.BEGIN}\n{check_text.END}\nafter\n")

    def check(self, write=False):
        return list(check_text.check_room_table(self.root, write))

    def test_the_printed_table_passes_and_the_rest_of_the_page_stays(self):
        self.assert_found(self.check(), "ARCHITECTURE.md:2: the table of rooms differs")
        self.assert_found(self.check(write=True))
        self.assert_found(self.check())
        page = (self.root / "ARCHITECTURE.md").read_text()
        self.assertIn(ROW + "\n| deploy | scripts | - | - |\n", page)
        self.assertTrue(page.startswith("# Page\n") and page.endswith("\nafter\n"))
        self.write("ARCHITECTURE.md", page.replace("| clocks |", "| watches |"))
        self.assert_found(self.check(), "differs")

    def test_a_room_without_description_and_a_description_without_room_are_found(self):
        self.check(write=True)
        self.write("deploy/lint/rooms.toml", ROOMS.replace('"server/base" = "clocks"', '"server/bass" = "clocks"'))
        self.assert_found(self.check(), "no line for server/base", "names server/bass", "differs")

    def test_a_page_without_markers_is_found(self):
        self.write("ARCHITECTURE.md", "# Page\n")
        self.assert_found(self.check(), "differs")


if __name__ == "__main__":
    unittest.main()
