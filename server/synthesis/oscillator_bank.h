// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "server/synthesis/bank_kernel.h"
#include "server/synthesis/lane_arrays.h"
#include "server/synthesis/lane_mix.h"
#include "server/synthesis/sounding_modes.h"
#include "server/synthesis/strike.h"
#include "server/synthesis/sustained_force.h"

namespace carillon {

/// Mode shapes of one body on its sounding surface, #V by 3 by #m, row-major:
/// values[(vertex * 3 + axis) * mode_count + column]. Shared with the modal model that owns them.
struct ShapeTable {
  std::shared_ptr<const float> values;
  size_t vertex_count = 0;
  size_t mode_count = 0;
};

/// How a bank is rendered.
struct OscillatorBankSettings {
  double sample_rate_hz = 48000;
  size_t block_frame_count = 128;  ///< at most kMostBlockFrames
  double gain = 1;                 ///< of this object, linear
  uint64_t noise_seed = 0;         ///< of this object's roughness
};

/// All modes of one sounding object, each a decaying complex exponential (the paper, 3.4):
///
///   Z_m(n+1) = q_m Z_m(n),  q_m = exp((sigma_m + i omega_m) / sample rate),  output = sum Re Z_m
///
/// A strike adds -i c_m g_m / omega_m exp(i phase_m) exp(s_m^2 tau^2 / 2) to Z_m at its time, with
/// g_m = sum_v w_v phi_m(v) . J and s_m = sigma_m + i omega_m; the last factor is the Gaussian
/// contact, exact once the contact is over (where sigma^2 > omega^2, exp(-|s_m|^2 tau^2 / 2)
/// instead).
///
/// Within a block the state is float, SIMD across modes; between blocks it is kept in double, which
/// holds the error below -100 dB. Modes that fall below -140 dB of full scale fall asleep.
///
/// The second mode of a degenerate pair is a cosine, which would begin with a jump: a click under a
/// soft mallet. It comes with a companion of the same frequency and opposite sign that decays by
/// exp(-1) in a radian: the sum, cos(omega t) (exp(sigma t) - exp((sigma - omega) t)), begins at
/// zero with the slope of its sibling.
///
/// Made anywhere; then used by one thread at a time. Strike and Render neither allocate nor lock.
class OscillatorBank {
 public:
  OscillatorBank(const SoundingModes& sounding, ShapeTable shapes,
                 const OscillatorBankSettings& settings);

  /// Applies an excitation at sample `offset` of the block to be rendered next, `lead_frames` (0 to
  /// 1) after it happened. Offsets within one block may not go back. False: not finite or no such
  /// vertex, and nothing was done.
  bool Strike(const Excitation& excitation, size_t offset, float lead_frames,
              LaneMix& mix) noexcept;

  /// Adds a contact's force to that at the next knot. False: no such vertex, and nothing was done.
  bool Gather(const Excitation& force) noexcept;

  /// The sustained force has come to what was gathered, at sample `offset` as for Strike. False: it
  /// was not finite, and is zero.
  bool Tie(const ForceKnot& knot, size_t offset, LaneMix& mix) noexcept;

  /// Adds the next block of `block_frame_count` frames to `mix`. False: the state was not finite
  /// and the bank has been silenced.
  bool RenderAdd(LaneMix& mix) noexcept;

  /// Nothing rings: rendering would cost and add nothing.
  bool silent() const noexcept { return awake_lane_count_ == 0 && !newborn_ && !force_.driving(); }

  /// Modes that still ring.
  size_t active_mode_count() const noexcept;

  /// Modes of the object.
  size_t mode_count() const noexcept { return mode_count_; }

 private:
  std::optional<bank_kernel::Projection> Project(const Excitation& excitation) const noexcept;
  void BringNewbornTo(size_t offset, LaneMix& mix) noexcept;
  void RenderNewborn(size_t end, LaneMix& mix) noexcept;

  ShapeTable shapes_;
  size_t block_frame_count_;
  size_t mode_count_;
  size_t lane_count_;  // modes and companions, padded to whole vectors
  size_t first_column_ = 0;
  size_t column_count_ = 0;
  size_t awake_lane_count_ = 0;  // the lanes beyond it sleep
  bool newborn_ = false;         // struck in this block
  size_t newborn_offset_ = 0;    // the newborn state is that of this sample
  LaneArrays lanes_;
  SustainedForce force_;
};

/// The SIMD target in use on this machine ("AVX3", "AVX2", "SSE4", "NEON", ...).
std::string_view SimdTarget();

}  // namespace carillon
