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

/// An impulse, or a force, on a triangle of the sounding surface.
struct Excitation {
  std::array<uint32_t, 3> vertices{};
  std::array<float, 3> weights{};                 ///< barycentric
  std::array<float, 3> impulse_newton_seconds{};  ///< in the object's frame; of a force, N
  float tau_s = 0;  ///< standard deviation of the contact's Gaussian; zero: instantaneous
};

/// What a sustained force has come to at the end of a simulation step, its kind of surface
/// included.
struct ForceKnot {
  float step_s = 0;        ///< since the knot before
  float roughness = 0;     ///< root mean square of the fluctuation, relative to the force
  float bandwidth_hz = 0;  ///< of the fluctuation; zero: it does not move, so there is none
};

/// Where a voice, or the listener who hears it, goes.
struct Motion {
  std::array<float, 3> position_m{};
  std::array<float, 3> right{1, 0, 0};  ///< of the listener: the direction to the right
  float glide_frames = 0;               ///< on the way, which is straight; below one: a jump
};

/// A move travels in the place of an excitation, so that strikes are no larger for it.
constexpr Excitation ToExcitation(const Motion& motion) {
  return {.weights = motion.position_m,
          .impulse_newton_seconds = motion.right,
          .tau_s = motion.glide_frames};
}

constexpr Motion ToMotion(const Excitation& excitation) {
  return {.position_m = excitation.weights,
          .right = excitation.impulse_newton_seconds,
          .glide_frames = excitation.tau_s};
}

/// What a strike does to its bank.
enum class StrikeKind : uint8_t {
  kImpulse,       ///< the excitation at once
  kForce,         ///< adds the excitation to the force at the next knot
  kKnot,          ///< the forces added since the last knot are the whole force now
  kMove,          ///< the bank's voice goes elsewhere
  kMoveListener,  ///< the listener of the bank's voice does
};

/// An excitation of one bank at its time: frame + fraction, in frames since the mixer began. The
/// first sample that can be heard is the first at or after it, with the phase that has passed
/// since.
struct Strike {
  BankId bank{};
  uint64_t frame = 0;
  float fraction = 0;  ///< 0 <= fraction < 1
  StrikeKind kind = StrikeKind::kImpulse;
  Excitation excitation{};  ///< of an impulse or a force; of a move, ToExcitation of it
  ForceKnot knot{};         ///< of a knot
};

/// Number of the first sample that can be heard.
inline uint64_t FirstSample(const Strike& strike) noexcept {
  return strike.frame + (strike.fraction > 0 ? 1 : 0);
}

}  // namespace carillon
