// SPDX-License-Identifier: Apache-2.0
#include "server/daemon/data_directory.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <latch>
#include <optional>
#include <thread>

#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

TEST(DataDirectory, IsMadeForItsOwnerOnly) {
  const TemporaryFolder folder;
  ASSERT_TRUE(DataDirectory::Open(folder / "a/b").ok());
  EXPECT_EQ(std::filesystem::status(folder / "a/b").permissions(),
            std::filesystem::perms::owner_all);
}

TEST(DataDirectory, IsCheckedWithoutBeingMade) {
  const TemporaryFolder folder;
  EXPECT_TRUE(DataDirectory::Check(folder / "a/b").ok());
  EXPECT_TRUE(DataDirectory::Check(folder / "a").ok());
  EXPECT_FALSE(std::filesystem::exists(folder / "a"));
  WriteBytes(folder / "file", "");
  for (const std::filesystem::path& path :
       {folder / "file", folder / "file/a", std::filesystem::path("/proc/a/b")}) {
    EXPECT_THAT(DataDirectory::Check(path).ToString(), testing::HasSubstr("DATABASE_UNUSABLE: "))
        << path;
    EXPECT_FALSE(DataDirectory::Open(path).ok()) << path;
  }
}

TEST(DataDirectory, IsHeldByOneAtATime) {
  const TemporaryFolder folder;
  std::optional<absl::StatusOr<DataDirectory>> first = DataDirectory::Open(folder / "data");
  ASSERT_TRUE(first->ok());
  const absl::Status second = DataDirectory::Open(folder / "data").status();
  EXPECT_EQ(second.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(second.ToString(), testing::HasSubstr("DATABASE_BUSY: "));
  first.reset();
  EXPECT_TRUE(DataDirectory::Open(folder / "data").ok());
}

TEST(DataDirectory, WaitsForOneThatIsBeingGivenUp) {
  const TemporaryFolder folder;
  // In most rounds the other thread tries while the first still has the folder.
  for (int round = 0; round < 20; ++round) {
    std::optional<absl::StatusOr<DataDirectory>> first = DataDirectory::Open(folder / "data");
    ASSERT_TRUE(first->ok());
    std::latch begun(1);
    std::thread other([&] {
      begun.count_down();
      EXPECT_TRUE(DataDirectory::Open(folder / "data").ok());
    });
    begun.wait();
    std::this_thread::yield();
    first.reset();
    other.join();
  }
}

}  // namespace
}  // namespace carillon
