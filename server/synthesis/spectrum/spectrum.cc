// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/spectrum/spectrum.h"

#include <algorithm>
#include <cassert>

#include "server/synthesis/spectrum/spreading_kernel.h"

namespace carillon {
namespace {

constexpr size_t kMargin = kSpreadBins / 2;

}  // namespace

Spectrum::Spectrum(const LongBlock& block)
    : block_(block),
      slots_(SlotCount(block.grid_size) * 2 * kSpreadBins),
      bins_(SlotCount(block.grid_size) + kSpreadBins),
      half_(block.grid_size / 2 + 1),
      samples_(block.grid_size),
      deconvolution_(MakeDeconvolution(block)),
      transform_(block.grid_size) {}

void Spectrum::Transform(std::span<float> frames) noexcept {
  assert(frames.size() == block_.frame_count);
  GatherSlots();
  Fold();
  transform_.Run(half_, samples_);
  const size_t middle = frames.size() / 2;
  const float* before = samples_.data() + block_.grid_size - middle;
  for (size_t n = 0; n < middle; ++n) frames[n] = before[n] * deconvolution_[n];
  for (size_t n = middle; n < frames.size(); ++n) {
    frames[n] = samples_[n - middle] * deconvolution_[n];
  }
}

void Spectrum::GatherSlots() noexcept {
  std::ranges::fill(bins_, std::complex<float>());
  auto* bins = reinterpret_cast<float*>(bins_.data());
  const size_t slot_count = SlotCount(block_.grid_size);
  constexpr size_t kFloats = 2 * kSpreadBins;
  // Every kSpreadBins-th slot: these do not overlap, so that no addition waits for the previous
  // one.
  for (size_t first = 0; first < kSpreadBins; ++first) {
    for (size_t slot = first; slot < slot_count; slot += kSpreadBins) {
      float* from = slots_.data() + slot * kFloats;
      float* to = bins + 2 * slot;
      for (size_t i = 0; i < kFloats; ++i) to[i] += from[i];
      std::fill_n(from, kFloats, 0.0F);
    }
  }
}

/// Only the real part of the signal is needed: a bin below zero or above Nyquist is added to its
/// mirror image as the conjugate. Bins strictly between count twice in the inverse transform.
void Spectrum::Fold() noexcept {
  const size_t nyquist = block_.grid_size / 2;
  for (size_t k = 0; k <= nyquist; ++k) half_[k] = bins_[k + kMargin];
  for (size_t k = 1; k <= kMargin; ++k) {
    half_[k] += std::conj(bins_[kMargin - k]);
    half_[nyquist - k] += std::conj(bins_[kMargin + nyquist + k]);
  }
  for (size_t k = 1; k < nyquist; ++k) half_[k] *= 0.5F;
}

}  // namespace carillon
