// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/program/confine_writes.h"

#include <gtest/gtest.h>
#include <linux/landlock.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

namespace carillon::precompute {
namespace {

bool CanWrite(const std::filesystem::path& file) {
  std::ofstream stream(file);
  return static_cast<bool>(stream << "1" << std::flush);
}

struct ConfineWritesTest : ::testing::Test {
  ConfineWritesTest() {
    std::string pattern = testing::TempDir() + "confined_XXXXXX";
    folder = mkdtemp(pattern.data());
    std::filesystem::create_directory(folder / "own");
    CanWrite(folder / "strange");
  }
  ~ConfineWritesTest() override { std::filesystem::remove_all(folder); }

  std::filesystem::path folder;
};

TEST_F(ConfineWritesTest, FilesOfOtherFoldersStayAsTheyAre) {
  if (syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION) < 1) {
    GTEST_SKIP() << "the kernel has no Landlock";
  }
  const auto confined = [&] {
    ConfineWrites(std::vector<std::string>{folder / "own/model"});
    std::error_code error;
    const bool own = CanWrite(folder / "own/model.part") &&
                     (std::filesystem::rename(folder / "own/model.part", folder / "own/model"),
                      CanWrite("/dev/null"));
    const bool others = CanWrite(folder / "strange") || CanWrite(folder / "new") ||
                        std::filesystem::remove(folder / "strange", error) ||
                        std::filesystem::create_directory(folder / "more", error);
    const bool reads = std::ifstream(folder / "strange").good();
    _exit(own && !others && reads ? 0 : 1);
  };
  EXPECT_EXIT(confined(), ::testing::ExitedWithCode(0), "");
  EXPECT_TRUE(std::filesystem::exists(folder / "own/model"));
  EXPECT_TRUE(std::filesystem::exists(folder / "strange"));
}

}  // namespace
}  // namespace carillon::precompute
