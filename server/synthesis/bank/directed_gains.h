// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/synthesis/bank/harmonic_basis.h"
#include "server/synthesis/bank/radiation.h"
#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/ring_kernel.h"
#include "server/synthesis/schedule/bearing.h"

namespace carillon {

/// The way in which a listener hears the directions of a bank's modes.
struct HeardDirectivity {
  Directivity directivity;
  double size = 1;  ///< relative to the model's size
  double sound_speed_m_per_s = 343;
  /// Whether the gains use the factors h_l(k r) of the near field instead of their limits far away.
  bool near_field = false;
};

/// The complex gain of each mode of a bank towards the listener,
///
///   g = sqrt(4 pi) conj(sum over l, m of p_lm f_l(k r) Y_lm(direction))
///
/// where p_lm are the coefficients of Directivity and f_l(x) = i^(l + 1) x exp(-ix) h_l(x) is 1 far
/// away. The recursion is f_(l+1) = i (2l + 1)/x f_l + f_(l-1), f_0 = f_(-1) = 1 (Abramowitz and
/// Stegun, 10.1.19). Without near_field f_l is 1. Far away the mean of |g|^2 over all directions is
/// one, so |g| is relative to a mode that radiates its power equally in all directions. The
/// conjugate is taken because a transfer has the time dependence exp(-i omega t), and a bank exp(i
/// omega t).
///
/// A struck mode begins as a sine. The imaginary part of its gain adds a cosine, which begins with
/// a jump. Therefore each mode has a companion (OscillatorBank) with the gain i Im g, and the sum
/// of the two begins at zero.
///
/// The gains are computed for one bearing in each period of 10 ms or longer, and a part of them in
/// each block, so that a body with many harmonics costs no more in a block than a body with few.
/// Between periods the gains are interpolated linearly, and reach those of a period's bearing two
/// periods later.
///
/// Any thread may construct the object; then one thread at a time uses it. Only the constructor
/// allocates.
class DirectedGains {
 public:
  /// A mode and the lane in which it rings.
  struct Mode {
    uint32_t column = 0;    ///< in the modal model
    double wavenumber = 0;  ///< 1/m, in air
    size_t lane = 0;
    size_t companion_lane = 0;
  };
  struct Size {
    size_t lane_count = 0;
    size_t period_frame_count = 0;  ///< least length of a period
    size_t block_frame_count = 0;
  };

  DirectedGains(const HeardDirectivity& heard, std::vector<Mode> modes, const Size& size);

  /// Computes the gains of block `block_number`; further calls for the same block have no effect.
  /// If the previous block had no call, the gains start at `bearing`.
  void BeginBlock(uint64_t block_number, const Bearing& bearing) noexcept;

  /// Whether the gains at the block's end differ from those at its start.
  bool moving() const noexcept { return moving_; }

  /// The gains of all lanes at the start of the block, if they move, and at its end.
  ring_kernel::Gains at_begin() const noexcept { return begin_.gains(); }
  ring_kernel::Gains at_end() const noexcept { return end_.gains(); }

  /// The centre from which bearings are measured, in the object's frame.
  const std::array<double, 3>& center_m() const noexcept { return center_m_; }

  /// The bearing that the newest gains belong to.
  const Bearing& bearing() const noexcept { return bearing_; }

  /// Returns the number of terms in the sums of all gains.
  size_t term_count() const noexcept { return term_count_; }

  /// Returns the most terms that a block computes. The last mode may exceed this number by its own
  /// terms.
  size_t terms_per_block() const noexcept { return term_count_ / period_ + 1; }

 private:
  /// The gains of all lanes.
  struct LaneGains {
    explicit LaneGains(size_t lane_count) : re(lane_count), im(lane_count) {}
    ring_kernel::Gains gains() const noexcept { return {.re = re.data(), .im = im.data()}; }
    LaneArray<float> re, im;
  };

  /// Returns `bearing`, moved out of the sphere that encloses the body.
  Bearing Outside(const Bearing& bearing) const noexcept;
  bool Differs(const Bearing& bearing) const noexcept;
  void Aim(const Bearing& bearing) noexcept;
  void StartAt(const Bearing& bearing) noexcept;
  void BeginPeriod(const Bearing& bearing) noexcept;
  /// Computes gains of further modes, until `term_count` terms of the period have been computed.
  void ComputeUntil(size_t term_count) noexcept;
  void SetGain(const Mode& mode) noexcept;
  /// A complex number; the operators of std::complex call functions that check for infinities.
  struct Number {
    double re = 0, im = 0;
  };
  /// The sum over some harmonics, with f_l = 1.
  Number FarPattern(size_t first, size_t end) const noexcept;
  Number NearPattern(size_t first, size_t end, double kr) const noexcept;
  void Glide() noexcept;

  Directivity directivity_;
  std::array<double, 3> center_m_;
  double radius_m_;
  bool near_field_;
  std::vector<Mode> modes_;
  HarmonicBasis basis_;
  size_t lane_count_;
  size_t term_count_ = 0;
  size_t period_ = 1;  // blocks
  LaneGains begin_, end_, target_, next_;
  Bearing bearing_;  // the newest gains belong to this bearing
  uint64_t block_number_ = UINT64_MAX - 1;
  size_t block_of_period_ = 0;
  size_t computed_mode_count_ = 0, computed_term_count_ = 0;  // of next_
  bool known_ = false;                                        // gains were computed before
  bool computing_ = false;  // next_ is being computed in this period
  bool gliding_ = false;    // to target_ in this period
  bool moving_ = false;
};

}  // namespace carillon
