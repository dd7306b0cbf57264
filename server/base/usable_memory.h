// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

namespace carillon {

/// Returns the memory that this process may use, bytes: that of the machine, or less if the control
/// group of the process, or a group above it, has a smaller limit (memory.max of version 2,
/// memory.limit_in_bytes of version 1). The tests give other paths.
uint64_t UsableMemoryBytes(const std::filesystem::path& groups_of_process = "/proc/self/cgroup",
                           const std::filesystem::path& hierarchy = "/sys/fs/cgroup");

}  // namespace carillon
