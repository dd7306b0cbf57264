// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace carillon {

/// How an impulse is rendered in a block that has more impulses than can be rendered in time.
enum class Treatment : uint8_t {
  kExact,
  kMerged,  ///< at the nearest vertex, as one with its neighbours in time
  kShed,    ///< not at all
};

/// Chooses the treatment of impulses by their loudness, so that their total work stays within a
/// bound: the loudest are exact, the next are merged and the quietest are shed. It uses a
/// histogram, so its time is linear in the number of impulses.
class LoudnessTriage {
 public:
  /// Empties the histogram.
  void Clear() noexcept;

  /// Adds an impulse: its loudness, and its work if it is rendered exactly or merged.
  void Note(float loudness, double exact_work, double merged_work) noexcept;

  /// Decides the treatment of every loudness, and returns the resulting work of all noted impulses.
  double Decide(double most_work) noexcept;

  /// Impulses quieter than this are shed; zero if no impulse is shed.
  float shed_below() const noexcept;

  Treatment Treat(float loudness) const noexcept;

 private:
  /// A bin is a float's exponent and the first three bits of its fraction: 0.5 to 1 dB wide.
  static constexpr size_t kBins = 2040;
  static size_t Bin(float loudness) noexcept;

  /// Merges all impulses, then spends the remaining work on rendering the loudest exactly.
  double ShareOut(double most_work, double all_merged) noexcept;

  struct Work {
    double exact = 0;
    double merged = 0;
  };
  std::array<Work, kBins> bins_;
  Work all_;
  size_t first_merged_ = 0;  // bins from here to first_exact_ are merged, those below are shed
  size_t first_exact_ = 0;   // bins from here on are exact
};

}  // namespace carillon
