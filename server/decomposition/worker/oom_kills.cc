// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker/oom_kills.h"

#include <fstream>
#include <string>

namespace carillon {

std::optional<uint64_t> OomKillCount(const std::filesystem::path& kernel_counts) {
  std::ifstream file(kernel_counts);
  std::string name;
  uint64_t count = 0;
  while (file >> name >> count) {
    if (name == "oom_kill") return count;
  }
  return std::nullopt;
}

}  // namespace carillon
