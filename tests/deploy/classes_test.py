# SPDX-License-Identifier: Apache-2.0
import unittest

from tree import TreeTest
import check_classes


class Classes(TreeTest):
    def found(self, *expected):
        self.assert_found(check_classes.check(self.root), *expected)

    def test_a_class_with_one_pair_of_files_passes(self):
        self.write("server/mixer.h", "class Mixer final : public Base {\n  void Render();\n};\n")
        self.write("server/mixer.cc", "void Mixer::Render() {\n  Bus::Mix();\n}\n")
        self.found()

    def test_a_member_in_a_second_file_is_found(self):
        self.write("server/mixer.h", "class Mixer {\n  Bus& bus();\n  ~Mixer();\n};\n")
        self.write("server/mixer.cc", "Mixer::~Mixer() {}\n")
        self.write("server/mixer_buses.cc", "int x;\nBus& Mixer::bus() {\n}\n")
        self.found("server/mixer_buses.cc:2: defines a member of Mixer, which mixer.h declares")

    def test_a_class_of_its_own_file_and_one_of_the_same_name_in_another_room_pass(self):
        self.write("server/api/state.h", "struct State {\n};\n")
        self.write("server/mixer.cc", "class State {\n  void Go();\n};\nvoid State::Go() {\n}\n")
        self.write("server/other.cc", "void State::Go() {\n}\n")
        self.found()


if __name__ == "__main__":
    unittest.main()
