// SPDX-License-Identifier: Apache-2.0
#include "server/base/usable_memory.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include "absl/strings/str_split.h"

namespace carillon {
namespace {

namespace fs = std::filesystem;

uint64_t MachineBytes() {
  return static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) *
         static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

/// Returns the least limit in the files `name` of the group `path` and of the groups above it, up
/// to the folder `root`, or `most` if no limit is smaller. A container may see the path of its
/// group outside, of which only the root is mounted.
uint64_t LeastLimit(const fs::path& root, const fs::path& path, const char* name, uint64_t most) {
  for (fs::path group = path.relative_path();; group = group.parent_path()) {
    uint64_t limit = 0;
    // The word "max" stands for no limit, and is not read as a number.
    if (std::ifstream(root / group / name) >> limit) most = std::min(most, limit);
    if (group.empty()) return most;
  }
}

}  // namespace

uint64_t UsableMemoryBytes(const fs::path& groups_of_process, const fs::path& hierarchy) {
  uint64_t bytes = MachineBytes();
  std::ifstream groups(groups_of_process);
  for (std::string line; std::getline(groups, line);) {
    // "NUMBER:CONTROLLERS:PATH" (cgroups(7)); version 2 has no controllers here.
    const std::vector<std::string> parts = absl::StrSplit(line, absl::MaxSplits(':', 2));
    if (parts.size() < 3) continue;
    const std::vector<std::string> controllers = absl::StrSplit(parts[1], ',');
    if (parts[1].empty()) bytes = LeastLimit(hierarchy, parts[2], "memory.max", bytes);
    if (std::ranges::find(controllers, "memory") == controllers.end()) continue;
    bytes = LeastLimit(hierarchy / "memory", parts[2], "memory.limit_in_bytes", bytes);
  }
  return bytes;
}

}  // namespace carillon
