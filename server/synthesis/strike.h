// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace carillon {

/// Names a bank in a mixer; a default one names none.
struct BankId {
  uint32_t slot = UINT32_MAX;
  uint32_t generation = 0;
  friend bool operator==(const BankId&, const BankId&) = default;
};

/// An impulse on a triangle of the sounding surface.
struct Excitation {
  std::array<uint32_t, 3> vertices{};
  std::array<float, 3> weights{};                 ///< barycentric
  std::array<float, 3> impulse_newton_seconds{};  ///< in the object's frame
  float tau_s = 0;  ///< standard deviation of the contact's Gaussian; zero: instantaneous
};

/// An excitation of one bank at its time: frame + fraction, in frames since the mixer began. The
/// first sample that can be heard is the first at or after it, with the phase that has passed
/// since.
struct Strike {
  BankId bank;
  uint64_t frame = 0;
  float fraction = 0;  ///< 0 <= fraction < 1
  Excitation excitation;
};

}  // namespace carillon
