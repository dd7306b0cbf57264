// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstddef>
#include <span>
#include <vector>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/spectrum/inverse_transform.h"
#include "server/synthesis/spectrum/long_block.h"

namespace carillon {

/// The spectrum of one long block: all modes that ring freely are added to it, then it is
/// transformed once for all of them. Only the constructor allocates; nothing locks.
class Spectrum {
 public:
  explicit Spectrum(const LongBlock& block);

  /// Slot s begins at slots()[2 * kSpreadBins * s] and holds kSpreadBins bins, from bin s -
  /// kSpreadBins/2 on, real part before imaginary part. Neighbouring slots overlap in bins but not
  /// in memory, so that adding to one slot never waits for adding to its neighbour.
  float* slots() noexcept { return slots_.data(); }

  /// Writes the frames of the long block, and clears the spectrum for the next long block.
  void Transform(std::span<float> frames) noexcept;

 private:
  void GatherSlots() noexcept;
  void Fold() noexcept;

  LongBlock block_;
  LaneArray<float> slots_;
  std::vector<std::complex<float>> bins_;  // from bin -kSpreadBins/2 on
  std::vector<std::complex<float>> half_;  // bins 0 to Nyquist
  std::vector<float> samples_;
  std::vector<float> deconvolution_;
  InverseTransform transform_;
};

}  // namespace carillon
