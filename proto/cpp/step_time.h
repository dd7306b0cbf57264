// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace carillon {

/// The largest magnitude of ContactStep.time_s, seconds. A simulator may send the seconds since
/// 1970, and neighbouring doubles of this size are 2 us apart.
constexpr double kLargestStepTimeS = 1e10;

}  // namespace carillon
