// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/voice/convolution_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/synthesis/voice/convolution_kernel.cc"
// foreach_target.h includes this file once for each target, and must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

#include <cstddef>

HWY_BEFORE_NAMESPACE();
namespace carillon::convolution_kernel {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::ScalableTag<float>;

/// Computes four vectors of the sound, so that each tap is loaded once for all of them.
HWY_INLINE void ConvolveFour(std::span<const float> taps, const float* newest, float* sound) {
  const Floats d;
  const size_t lanes = hn::Lanes(d);
  auto sum0 = hn::Zero(d), sum1 = sum0, sum2 = sum0, sum3 = sum0;
  for (const float value : taps) {
    const auto tap = hn::Set(d, value);
    sum0 = hn::MulAdd(tap, hn::LoadU(d, newest), sum0);
    sum1 = hn::MulAdd(tap, hn::LoadU(d, newest + lanes), sum1);
    sum2 = hn::MulAdd(tap, hn::LoadU(d, newest + 2 * lanes), sum2);
    sum3 = hn::MulAdd(tap, hn::LoadU(d, newest + 3 * lanes), sum3);
    --newest;
  }
  hn::StoreU(sum0, d, sound);
  hn::StoreU(sum1, d, sound + lanes);
  hn::StoreU(sum2, d, sound + 2 * lanes);
  hn::StoreU(sum3, d, sound + 3 * lanes);
}

void Convolve(std::span<const float> taps, std::span<const float> signal, std::span<float> sound) {
  const float* const newest = signal.data() + (taps.size() - 1);
  const size_t step = 4 * hn::Lanes(Floats());
  size_t n = 0;
  for (; n + step <= sound.size(); n += step) ConvolveFour(taps, newest + n, &sound[n]);
  for (; n < sound.size(); ++n) {
    float sum = 0;
    const float* frame = newest + n;
    for (const float tap : taps) sum += tap * *frame--;
    sound[n] = sum;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace carillon::convolution_kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carillon::convolution_kernel {
HWY_EXPORT(Convolve);

void Convolve(std::span<const float> taps, std::span<const float> signal,
              std::span<float> sound) noexcept {
  HWY_DYNAMIC_DISPATCH(Convolve)(taps, signal, sound);
}

}  // namespace carillon::convolution_kernel
#endif
