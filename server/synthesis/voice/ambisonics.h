// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "server/base/pose.h"

namespace carillon {

/// Most channels of a voice: those of ambisonics of the third order.
inline constexpr size_t kMostChannels = 16;

/// Returns the gains of the channels of ambisonics for sound from `direction`, a unit vector in the
/// frame of a listener, who looks along -z with x to the right and y up. The channels are in the
/// order ACN and normalized by SN3D:
///
///   Y_lm = sqrt((2 - delta_m0) (l - |m|)! / (l + |m|)!) P_l|m|(sin elevation) cos or sin(|m|
///   azimuth)
///
/// (Nachbar, Zotter, Deleflie and Sontacchi, AmbiX, Ambisonics Symposium 2011). Only the first
/// channel hears a direction of zero.
std::array<float, kMostChannels> AmbisonicGains(const Vector3& direction) noexcept;

}  // namespace carillon
