// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstddef>
#include <memory>
#include <span>

namespace carillon {

/// The inverse Fourier transform of a half spectrum, to real samples:
///
///   x(n) = Re X_0 + 2 Re sum_{0<k<M/2} X_k exp(2 pi i k n/M) + (-1)^n Re X_{M/2}
///
/// Run neither allocates nor locks. One thread at a time may call it.
class InverseTransform {
 public:
  /// `size` M is a power of two.
  explicit InverseTransform(size_t size);

  /// `spectrum` has M/2 + 1 bins, `samples` M.
  void Run(std::span<const std::complex<float>> spectrum, std::span<float> samples) noexcept;

  size_t size() const noexcept { return size_; }

 private:
  struct Free {
    void operator()(void* plan) const noexcept;
  };
  size_t size_;
  std::unique_ptr<void, Free> plan_;
};

}  // namespace carillon
