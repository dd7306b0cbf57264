// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/spectrum/inverse_transform.h"

#include <kissfft/kiss_fftr.h>

#include <bit>
#include <cassert>
#include <new>

namespace carillon {

static_assert(sizeof(kiss_fft_cpx) == sizeof(std::complex<float>));

void InverseTransform::Free::operator()(void* plan) const noexcept { kiss_fftr_free(plan); }

InverseTransform::InverseTransform(size_t size)
    : size_(size), plan_(kiss_fftr_alloc(static_cast<int>(size), 1, nullptr, nullptr)) {
  // kissfft may allocate in each run for other sizes than powers of two.
  assert(std::has_single_bit(size));
  if (plan_ == nullptr) throw std::bad_alloc();
}

void InverseTransform::Run(std::span<const std::complex<float>> spectrum,
                           std::span<float> samples) noexcept {
  assert(spectrum.size() == size_ / 2 + 1 && samples.size() == size_);
  kiss_fftri(static_cast<kiss_fftr_cfg>(plan_.get()),
             reinterpret_cast<const kiss_fft_cpx*>(spectrum.data()), samples.data());
}

}  // namespace carillon
