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

/// The spectrum of one long block under way: all modes that ring freely add to it, then it is
/// transformed once for all of them. Neither allocates nor locks once made.
class Spectrum {
 public:
  explicit Spectrum(const LongBlock& block);

  /// Slot s is slots()[2 * kSpreadBins * s] and what follows: bins s - kSpreadBins/2 and up, each
  /// real part before imaginary part. Private to the modes that begin there, so that adding to one
  /// never waits for adding to its neighbour.
  float* slots() noexcept { return slots_.data(); }

  /// Writes the frames of the long block and clears the spectrum for the next.
  void Transform(std::span<float> frames) noexcept;

 private:
  void GatherSlots() noexcept;
  void Fold() noexcept;

  LongBlock block_;
  LaneArray<float> slots_;
  std::vector<std::complex<float>> bins_;  // from -kSpreadBins/2 on
  std::vector<std::complex<float>> half_;  // 0 to Nyquist
  std::vector<float> samples_;
  std::vector<float> deconvolution_;
  InverseTransform transform_;
};

}  // namespace carillon
