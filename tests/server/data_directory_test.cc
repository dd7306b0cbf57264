// SPDX-License-Identifier: Apache-2.0
#include "server/data_directory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>

#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

TEST(DataDirectory, IsMadeForItsOwnerOnly) {
  const TemporaryFolder folder;
  ASSERT_TRUE(DataDirectory::Open(folder / "a/b").ok());
  EXPECT_EQ(std::filesystem::status(folder / "a/b").permissions(),
            std::filesystem::perms::owner_all);
}

TEST(DataDirectory, IsHeldByOneAtATime) {
  const TemporaryFolder folder;
  std::optional<absl::StatusOr<DataDirectory>> first = DataDirectory::Open(folder / "data");
  ASSERT_TRUE(first->ok());
  const absl::Status second = DataDirectory::Open(folder / "data").status();
  EXPECT_EQ(second.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(second.ToString(), testing::HasSubstr("DATA_DIRECTORY_IN_USE: "));
  first.reset();
  EXPECT_TRUE(DataDirectory::Open(folder / "data").ok());
}

TEST(DataDirectory, RefusesAFileInItsPlace) {
  const TemporaryFolder folder;
  WriteBytes(folder / "file", "");
  EXPECT_THAT(DataDirectory::Open(folder / "file").status().ToString(),
              testing::HasSubstr("DATA_DIRECTORY_UNUSABLE: "));
}

}  // namespace
}  // namespace carillon
