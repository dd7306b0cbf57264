# SPDX-License-Identifier: Apache-2.0
import subprocess
import unittest

from tree import TreeTest
import check_contract
import check_reasons

GOOD = """syntax = "proto3";

package carillon.v1;

// A message.
message Block {
  // A field.
  uint64 first_frame = 1;
}
"""


class Contract(TreeTest):
    def setUp(self):
        super().setUp()
        self.copy("proto/buf.yaml")

    def write_contract(self, text):
        self.write("proto/carillon/v1/block.proto", text)

    def commit(self, *more):
        for arguments in (["init", "-q"], ["add", "-A"],
                          ["-c", "user.name=a", "-c", "user.email=a@b.c", "commit", "-qm", "x"], *more):
            subprocess.run(["git", "-C", self.root, *arguments], check=True)

    def release(self):
        self.commit(["tag", "v1"])

    def test_a_clean_contract_passes(self):
        self.write_contract(GOOD)
        self.assert_found(check_contract.check(self.root))

    def test_a_field_without_comment_is_found(self):
        self.write_contract(GOOD.replace("  // A field.\n", ""))
        self.assert_found(check_contract.check(self.root), "block.proto:7")

    def test_a_changed_field_number_breaks(self):
        self.write_contract(GOOD)
        self.release()
        self.write_contract(GOOD.replace("= 1", "= 2"))
        self.commit()
        self.assert_found(check_contract.check(self.root), "deleted")

    def test_a_break_is_still_found_after_commits_that_leave_the_contract_alone(self):
        self.test_a_changed_field_number_breaks()
        self.write("server/a.cc", "")
        self.commit()
        self.assert_found(check_contract.check(self.root), "deleted")

    def test_before_the_first_release_no_change_breaks(self):
        self.write_contract(GOOD)
        self.commit()
        self.write_contract(GOOD.replace("= 1", "= 2"))
        self.commit()
        self.assert_found(check_contract.check(self.root))

    def test_a_changed_message_of_the_workers_breaks_no_client(self):
        private = GOOD.replace("carillon.v1", "carillon.worker.v1")
        self.write("proto/carillon/worker/v1/block.proto", private)
        self.write_contract(GOOD)
        self.release()
        self.write("proto/carillon/worker/v1/block.proto", private.replace("= 1", "= 2"))
        self.assert_found(check_contract.check(self.root))

    def test_an_added_field_does_not_break(self):
        self.write_contract(GOOD)
        self.release()
        self.write_contract(GOOD.replace("}\n", "  // More.\n  uint64 more = 2;\n}\n"))
        self.commit()
        self.assert_found(check_contract.check(self.root))


class Reasons(TreeTest):
    def write_table(self, *reasons):
        rows = "".join(f"| {reason} | NOT_FOUND | m | r |\n" for reason in reasons)
        self.write("proto/README.md", "| reason | gRPC code | meaning | repair |\n| --- |\n" + rows)

    def test_reasons_that_agree_pass(self):
        self.write("server/a.cc", 'Refusal(code, "NO_FILE", "x"); Error(StrCat("NO_NAME: ", n));')
        self.write_table("NO_FILE", "NO_NAME")
        self.assert_found(check_reasons.check(self.root))

    def test_a_reason_missing_from_the_table_is_found(self):
        self.write("server/a.cc", '\nreturn Refusal(absl::StatusCode::kNotFound,\n  "NO_FILE", "x");')
        self.write_table()
        self.assert_found(check_reasons.check(self.root), "server/a.cc:3: NO_FILE is not in")

    def test_a_reason_that_no_code_gives_is_found(self):
        self.write("server/a.cc", '// "NO_FILE"\n')
        self.write_table("NO_FILE")
        self.assert_found(check_reasons.check(self.root), "no code gives NO_FILE")

    def test_reasons_and_warnings_of_the_clients_are_checked_too(self):
        self.write("client_sdk/python/src/carillon/a.py", 'raise CarillonError("NO_FILE", "x")\n'
                   'Warning(id="TOO_LATE")\nif error.reason == "NOT_FOUND" or error.reason != "NO_NAME":')
        self.write("client_sdk/node/lib/a.js", "throw new CarillonError('NO_BODY', 'x'); warn({ id: 'TOO_SOON' });")
        self.write("server/a.cc", 'Add(warnings, "TOO_LOUD", 1);')
        self.write_table("NO_FILE")
        expected = ("a.py:3: NO_NAME is not", "a.js:1: NO_BODY is not", "a.cc:1: TOO_LOUD is not",
                    "a.py:2: TOO_LATE is not", "a.js:1: TOO_SOON is not")
        self.assert_found(check_reasons.check(self.root), *expected)
        self.write_table("NO_BODY", "NO_FILE", "NO_NAME")
        table = self.root / "proto/README.md"
        table.write_text(table.read_text() + "## Warnings\n" + "".join(
            f"| {name} | m |\n" for name in ("TOO_LATE", "TOO_LOUD", "TOO_QUIET", "TOO_SOON")))
        self.assert_found(check_reasons.check(self.root), "no code gives TOO_QUIET")


if __name__ == "__main__":
    unittest.main()
