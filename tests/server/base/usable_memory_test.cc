// SPDX-License-Identifier: Apache-2.0
#include "server/base/usable_memory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace carillon {
namespace {

constexpr uint64_t kMib = uint64_t{1} << 20U;

/// A folder with files as the system has them for control groups.
class UsableMemory : public testing::Test {
 public:
  ~UsableMemory() override { std::filesystem::remove_all(folder_); }

 protected:
  /// Writes a file, and makes its folders.
  void Write(const std::string& path, const std::string& content) const {
    std::filesystem::create_directories((folder_ / path).parent_path());
    std::ofstream(folder_ / path) << content << "\n";
  }

  uint64_t Bytes() const { return UsableMemoryBytes(folder_ / "cgroup", folder_ / "fs"); }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("usable_memory-" + std::to_string(getpid()));
  const uint64_t machine_ =
      static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
};

TEST_F(UsableMemory, IsTheMachinesWithoutAnyGroup) {
  EXPECT_EQ(Bytes(), machine_);
  EXPECT_LE(UsableMemoryBytes(), machine_);
  EXPECT_GT(UsableMemoryBytes(), 64 * kMib);
}

TEST_F(UsableMemory, IsTheLeastLimitOfAllGroupsAboveInBothVersions) {
  Write("cgroup", "0::/slice/service/daemon");
  Write("fs/slice/service/daemon/memory.max", std::to_string(400 * kMib));
  EXPECT_EQ(Bytes(), 400 * kMib);
  Write("fs/slice/memory.max", std::to_string(300 * kMib));
  Write("fs/slice/service/memory.max", std::to_string(500 * kMib));
  Write("fs/slice/service/daemon/memory.max", "max");
  EXPECT_EQ(Bytes(), 300 * kMib);
  Write("cgroup", "9:name=systemd:/\n4:cpu,memory:/docker/12ab\n0::/");
  Write("fs/memory/memory.limit_in_bytes", "9223372036854771712");
  Write("fs/memory/docker/12ab/memory.limit_in_bytes", std::to_string(250 * kMib));
  EXPECT_EQ(Bytes(), 250 * kMib);
}

}  // namespace
}  // namespace carillon
