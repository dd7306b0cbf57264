// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace carillon {

// The limits of the contract that the daemon and its clients in C++ both need. ServerLimits tells
// them to clients in other languages.

/// The largest message to the daemon.
inline constexpr size_t kMaxMessageBytes = size_t{2} << 20U;

/// The greatest length of a label. The daemon cuts a longer one.
inline constexpr size_t kMaxLabelBytes = 200;

/// The largest magnitude of ContactStep.time_s, seconds. A simulator may send the seconds since
/// 1970, and neighbouring doubles of this size are 2 us apart.
inline constexpr double kLargestStepTimeS = 1e10;

/// The extent of a body, metres, above which its file is probably in another unit.
inline constexpr double kLikelyExtentM = 20;

}  // namespace carillon
