// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/access/access_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "absl/strings/str_cat.h"
#include "server/base/sha256.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

using testing::HasSubstr;

class AccessTableFile : public testing::Test {
 protected:
  absl::StatusOr<AccessTable> Read(const std::string& text) {
    WriteBytes(file_, text);
    std::filesystem::permissions(file_, std::filesystem::perms(0600));
    return AccessTable::Read(file_);
  }

 private:
  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_ / "access";
};

TEST_F(AccessTableFile, ACallerIsFoundByItsTokenOrCertificateAndHasTheRolesOfItsLine) {
  const auto table = Read("# callers\n\nrobot  strike,submit\tsha256:" + Sha256Hex("secret") +
                          "\nconsole listen certificate:console.example.org\nanybody listen\n");
  ASSERT_TRUE(table.ok()) << table.status();
  const Principal* robot = table->FindToken("secret");
  ASSERT_NE(robot, nullptr);
  EXPECT_EQ(robot->name, "robot");
  EXPECT_TRUE(robot->has(Role::kStrike) && robot->has(Role::kSubmit) && robot->has(Role::kAny));
  EXPECT_FALSE(robot->has(Role::kListen) || robot->has(Role::kAdminister));
  EXPECT_EQ(table->FindToken("secre"), nullptr);
  EXPECT_EQ(table->FindToken(Sha256Hex("secret")), nullptr);
  EXPECT_EQ(table->FindToken(""), nullptr);
  const Principal* console = table->FindCertificate({"other", "console.example.org"});
  ASSERT_NE(console, nullptr);
  EXPECT_EQ(console->name, "console");
  EXPECT_EQ(table->FindCertificate({""}), nullptr);
  EXPECT_EQ(table->FindCertificate({"console.example"}), nullptr);
  EXPECT_TRUE(table->anybody().has(Role::kListen));
}

TEST_F(AccessTableFile, WithoutALineForAnybodyCallersThatShowNothingHaveNoRole) {
  const auto table = Read("# nobody\n");
  ASSERT_TRUE(table.ok()) << table.status();
  EXPECT_FALSE(table->anybody().has(Role::kAny));
}

TEST_F(AccessTableFile, ALineThatIsWrongIsNamed) {
  const std::string digest(64, '0');
  for (const std::string& line :
       {std::string("robot"), std::string("robot strike"), "robot sing sha256:" + digest,
        std::string("robot strike sha256:0"), "robot strike md5:" + digest,
        std::string("robot strike certificate:"), "robot strike sha256:" + digest + " more",
        "anybody listen sha256:" + digest, std::string("anybody ,")}) {
    EXPECT_THAT(Read("# one\n" + line + "\n").status().ToString(),
                testing::AllOf(HasSubstr("ACCESS_FILE_UNUSABLE: "), HasSubstr("line 2: ")))
        << line;
  }
}

TEST_F(AccessTableFile, TwoLinesThatContradictEachOtherAreNamed) {
  const std::string first = "robot strike sha256:" + Sha256Hex("secret") + "\n";
  const std::string console = "console listen certificate:console.example.org\n";
  for (const std::string& second :
       {"other administer sha256:" + Sha256Hex("secret"), "robot submit sha256:" + Sha256Hex("b"),
        std::string("other strike certificate:console.example.org"),
        std::string("anybody strike")}) {
    EXPECT_THAT(
        Read(absl::StrCat(first, console, "anybody listen\n", second, "\n")).status().ToString(),
        testing::AllOf(HasSubstr("ACCESS_FILE_UNUSABLE: "), HasSubstr("access line 4: "),
                       testing::ContainsRegex("that of line [12], too|line [13] gives")))
        << second;
  }
  const std::string next = "robot strike sha256:" + Sha256Hex("next") + "\n";
  const auto table = Read(first + console + "anybody listen\n" + next);
  ASSERT_TRUE(table.ok()) << table.status();
  EXPECT_EQ(table->FindToken("secret")->name, "robot");
  EXPECT_EQ(table->FindToken("next")->name, "robot");
}

TEST(AccessTable, WithoutAFileAnybodyMayDoAllButAdminister) {
  const AccessTable table = AccessTable::ForThisMachine();
  for (const Role role : {Role::kAny, Role::kListen, Role::kStrike, Role::kSubmit}) {
    EXPECT_TRUE(table.anybody().has(role)) << RoleName(role);
  }
  EXPECT_FALSE(table.anybody().has(Role::kAdminister));
}

}  // namespace
}  // namespace carillon
