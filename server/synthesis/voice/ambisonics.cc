// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/voice/ambisonics.h"

#include <algorithm>
#include <cmath>

namespace carillon {

std::array<float, kMostChannels> AmbisonicGains(const Vector3& direction) noexcept {
  if (direction == Vector3{}) return {1};
  // The axes of ambisonics: x to the front, y to the left, z up.
  const double x = -direction[2], y = -direction[0], z = direction[1];
  const double root3 = std::sqrt(3.0), root58 = std::sqrt(5.0 / 8), root38 = std::sqrt(3.0 / 8);
  const double root15 = std::sqrt(15.0);
  const std::array<double, kMostChannels> gains = {1,
                                                   y,
                                                   z,
                                                   x,
                                                   root3 * x * y,
                                                   root3 * y * z,
                                                   (3 * z * z - 1) / 2,
                                                   root3 * x * z,
                                                   root3 / 2 * (x * x - y * y),
                                                   root58 * y * (3 * x * x - y * y),
                                                   root15 * x * y * z,
                                                   root38 * y * (5 * z * z - 1),
                                                   z * (5 * z * z - 3) / 2,
                                                   root38 * x * (5 * z * z - 1),
                                                   root15 / 2 * z * (x * x - y * y),
                                                   root58 * x * (x * x - 3 * y * y)};
  std::array<float, kMostChannels> narrow{};
  std::ranges::transform(gains, narrow.begin(),
                         [](double gain) { return static_cast<float>(gain); });
  return narrow;
}

}  // namespace carillon
