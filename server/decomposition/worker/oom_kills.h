// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

namespace carillon {

/// The kernel's own counts, among them that of OOM kills.
inline constexpr char kKernelCounts[] = "/proc/vmstat";

/// Returns how many processes of this machine the kernel has killed for lack of memory, in whatever
/// control group. It counts a process before it kills it. Absent if `kernel_counts` does not tell.
std::optional<uint64_t> OomKillCount(const std::filesystem::path& kernel_counts);

}  // namespace carillon
