// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace carillon::precompute {

/// Largest number of modes of a model. More modes never sound at once, and the shapes of more modes
/// would fill gigabytes.
inline constexpr int kMaxModeCount = 5000;
/// Largest number of modes that may be found if only the most audible ones are kept.
inline constexpr int kMaxFoundModeCount = 20'000;

/// Largest expected number of modes that is reported. A larger expected number is reported as this
/// number.
inline constexpr double kMostExpectedModes = 1e9;

}  // namespace carillon::precompute
