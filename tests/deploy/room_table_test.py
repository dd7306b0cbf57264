# SPDX-License-Identifier: Apache-2.0
import unittest

from tree import TreeTest
import check_room_table

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


class RoomTable(TreeTest):
    def setUp(self):
        super().setUp()
        self.write("deploy/lint/rooms.toml", ROOMS)
        self.write("server/base/xxh3.cc", "")
        self.write("ARCHITECTURE.md", f"# Page\n{check_room_table.BEGIN}\n{check_room_table.END}\nafter\n")

    def check(self, **arguments):
        return list(check_room_table.check(self.root, **arguments))

    def test_what_was_printed_passes_and_the_rest_of_the_page_stays(self):
        self.assert_found(self.check(), "ARCHITECTURE.md:3: the table of rooms differs")
        self.assert_found(self.check(write=True))
        self.assert_found(self.check())
        page = (self.root / "ARCHITECTURE.md").read_text()
        self.assertIn(ROW + "\n| deploy | scripts | - | - |\n", page)
        self.assertTrue(page.startswith("# Page\n") and page.endswith("\nafter\n"))

    def test_a_row_changed_by_hand_is_found(self):
        self.check(write=True)
        page = (self.root / "ARCHITECTURE.md").read_text()
        self.write("ARCHITECTURE.md", page.replace("| clocks |", "| watches |"))
        self.assert_found(self.check(), "differs from rooms.toml")

    def test_a_room_without_description_and_a_description_without_room_are_found(self):
        self.write("deploy/lint/rooms.toml", ROOMS.replace('"server/base" = "clocks"', '"server/bass" = "clocks"'))
        self.assert_found(self.check(), "no line for server/base", "names server/bass", "differs")

    def test_a_page_without_markers_is_found(self):
        self.write("ARCHITECTURE.md", "# Page\n")
        self.assert_found(self.check(), "lacks the lines")


if __name__ == "__main__":
    unittest.main()
