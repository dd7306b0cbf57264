// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace carillon {

/// What becomes of a strike in a block that has more of them than can be rendered in time.
enum class Treatment : uint8_t {
  kExact,
  kMerged,  ///< on the nearest vertex, together with its neighbours in time
  kShed,
};

/// Chooses by loudness: the loudest strikes are exact, the next merged, the least audible shed, so
/// that their work stays within a bound. The time it takes does not depend on how the strikes are
/// distributed.
class LoudnessTriage {
 public:
  /// Forgets all.
  void Clear() noexcept;

  /// A strike of this loudness, which costs so much work exact or merged.
  void Note(float loudness, double exact_work, double merged_work) noexcept;

  /// Settles the treatment of all loudnesses; returns the work of what was noted.
  double Decide(double most_work) noexcept;

  /// Strikes quieter than this are shed; zero where none is.
  float shed_below() const noexcept;

  Treatment Treat(float loudness) const noexcept;

 private:
  /// Exponent and three bits of the fraction: 0.5 to 1 dB a bin.
  static constexpr size_t kBins = 2040;
  static size_t Bin(float loudness) noexcept;

  double ShareOut(double most_work, double all_merged) noexcept;

  struct Work {
    double exact = 0;
    double merged = 0;
  };
  std::array<Work, kBins> bins_;
  Work all_;
  size_t first_merged_ = 0;  // bins from the first exact one on are exact
  size_t first_exact_ = 0;
};

}  // namespace carillon
