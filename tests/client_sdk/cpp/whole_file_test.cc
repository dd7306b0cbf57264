// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cpp/internal/whole_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "absl/strings/str_cat.h"

namespace carillon::client {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// tests/integration/commands/test_database_commands.py writes and replaces whole files.
class WholeFileTest : public testing::Test {
 protected:
  void SetUp() override { fs::create_directory(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  static void Put(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }

  static std::string TextOf(const fs::path& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  static std::string Refused(const fs::path& path) {
    return WholeFile::Create(path).status().ToString();
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / absl::StrCat("whole_file_", getpid());
  const fs::path file_ = folder_ / "copy.db";
};

TEST_F(WholeFileTest, RefusesTheFilesOfADatabaseInUse) {
  for (const char* companion : {"-wal", "-shm", "-reserve", "-journal"}) {
    const std::string beside = file_.string() + companion;
    Put(file_, "live");
    Put(beside, "live");
    fs::create_symlink(file_, folder_ / "link");
    for (const fs::path& path : {file_, folder_ / "link", fs::path(beside)}) {
      EXPECT_THAT(Refused(path), HasSubstr("OUTPUT_NOT_WRITABLE: " + path.string())) << companion;
    }
    EXPECT_EQ(TextOf(file_) + TextOf(beside), "livelive");
    for (const fs::path& path : {fs::path(beside), folder_ / "link"}) fs::remove(path);
  }
  EXPECT_TRUE(WholeFile::Create(file_).ok());
  // The daemon removes a file of this name.
  const std::string unfinished = file_.string() + "-unfinished-backup-1";
  EXPECT_THAT(Refused(unfinished), HasSubstr("OUTPUT_NOT_WRITABLE: "));
  fs::remove(file_);
  EXPECT_TRUE(WholeFile::Create(unfinished).ok());
}

TEST_F(WholeFileTest, WritesAtOnceIntoAFileThatIsOpen) {
  Put(file_, "header");
  const int descriptor = open(file_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  std::string expected = "header";
  fs::create_symlink(absl::StrCat("/dev/fd/", descriptor), folder_ / "link");
  for (const fs::path& path : {fs::path(absl::StrCat("/dev/fd/", descriptor)), folder_ / "link"}) {
    absl::StatusOr<WholeFile> file = WholeFile::Create(path);
    ASSERT_TRUE(file.ok()) << file.status();
    ASSERT_TRUE(file->Write("a copy").ok());
    EXPECT_EQ(TextOf(file_), expected += "a copy");
  }
  Put(file_.string() + "-wal", "live");
  EXPECT_THAT(Refused(folder_ / "link"), HasSubstr("OUTPUT_NOT_WRITABLE: "));
  EXPECT_EQ(TextOf(file_), expected);
  close(descriptor);
}

TEST_F(WholeFileTest, SaysWhyItCannotBeWritten) {
  EXPECT_THAT(Refused(folder_), HasSubstr("OUTPUT_NOT_WRITABLE: "));
  EXPECT_THAT(Refused(folder_ / "none/a"), HasSubstr("/none does not exist"));
  absl::StatusOr<WholeFile> full = WholeFile::Create("/dev/full");
  ASSERT_TRUE(full.ok()) << full.status();
  EXPECT_THAT(full->Write("a copy").ToString(), HasSubstr("No space left on device"));
}

}  // namespace
}  // namespace carillon::client
