# SPDX-License-Identifier: Apache-2.0
import unittest

from tree import TreeTest
import check_spelling
import check_words

WORDS = "deploy/lint/words.toml"


class Words(TreeTest):
    def setUp(self):
        super().setUp()
        self.write(WORDS, r'''
not_read = ["tests/*"]
[[phrases]]
phrase = '\bmends?\b'
better = "repair"
[[phrases]]
phrase = '\bgrain of the mesh\b'
better = "element size"
only_in = ["precompute/*"]
''')

    def found(self, *expected):
        self.assert_found(check_words.check(self.root), *expected)

    def test_a_phrase_in_a_page_is_found_with_its_line_and_the_better_word(self):
        self.write("docs/a.md", "# Title\n\nOne line.\nThis mends it.\n")
        self.found('docs/a.md:4: "mends": repair')

    def test_code_in_a_page_is_not_read(self):
        self.write("README.md", "Call `mend`:\n\n    mend all\n\n```\nmend\n```\n[one](mend.md)\n")
        self.found()

    def test_a_phrase_in_a_comment_of_a_header_and_of_the_contract_is_found(self):
        self.write("server/a.h", "int mend;  \n/// It mends\n/// all.\n")
        self.write("proto/a.proto", "// To mend it.\n")
        self.found("proto/a.proto:1", "server/a.h:2")

    def test_names_in_a_comment_are_not_read(self):
        self.write("server/a.h", "/// Calls `mend`, mend() and mend_all.\n")
        self.found()

    def test_a_phrase_across_two_lines_is_found_where_it_is_about_that_folder(self):
        self.write("precompute/a.h", "// The grain of\n// the mesh.\n")
        self.write("server/a.h", "// The grain of\n// the mesh.\n")
        self.found("precompute/a.h:1")

    def test_strings_and_comments_of_a_source_are_read_and_its_code_is_not(self):
        self.write("server/a.cc", '#include "mend.h"\nreturn Invalid("REASON",\n        StrCat("mend it (", x, ")"));\n'
                                  'mend();\n// It mends.\n')
        self.found("server/a.cc:5", "server/a.cc:3")

    def test_a_phrase_across_two_strings_is_found(self):
        self.write("precompute/a.cc", 'Refusal("the grain of "\n        "the mesh");\n')
        self.found("precompute/a.cc:1")

    def test_files_that_are_listed_are_not_read(self):
        self.write("tests/a.h", "// It mends.\n")
        self.found()


class TheProjectsList(TreeTest):
    def setUp(self):
        super().setUp()
        self.copy(WORDS)

    def test_a_sentence_whose_subject_is_a_free_relative_is_found(self):
        self.write("docs/a.md", "What is streamed is prefetched.\n")
        self.assert_found(check_words.check(self.root), "What is streamed")

    def test_questions_and_indirect_questions_pass(self):
        self.write("docs/a.md", "What is a mode? The message says what is wrong and where.\n")
        self.assert_found(check_words.check(self.root))

    def test_a_fragment_that_begins_with_of_is_found(self):
        self.write("docs/a.md", "Of the error of a frequency: four.\n")
        self.assert_found(check_words.check(self.root), "Of the error")


class Spelling(TreeTest):
    def test_a_misspelt_word_is_found(self):
        self.write("docs/a.md", "It is " + "rec" + "ieved.\n")
        self.assert_found(check_spelling.check(self.root), "received")

    def test_right_words_pass(self):
        self.write("docs/a.md", "It swings to and fro.\n")
        self.assert_found(check_spelling.check(self.root))


if __name__ == "__main__":
    unittest.main()
