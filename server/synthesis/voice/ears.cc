// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/voice/ears.h"

#include <algorithm>
#include <cstddef>

#include "server/synthesis/voice/convolution_kernel.h"

namespace carillon {

Ears::Ears(const Head& head, size_t block_frame_count)
    : start_(head.Silent()), end_(start_), other_(block_frame_count) {
  for (std::vector<float>& signal : signals_) signal.resize(past_count() + block_frame_count);
}

void Ears::Turn(const Head& head, const Vector3& direction) noexcept {
  for (size_t ear = 0; ear < end_.size(); ++ear) start_[ear].taps.swap(end_[ear].taps);
  head.Respond(direction, end_);
}

void Ears::Jump(const Head& head, const Vector3& direction) noexcept {
  head.Respond(direction, end_);
  Hold();
  known_ = {};
}

void Ears::Hold() noexcept {
  for (size_t ear = 0; ear < end_.size(); ++ear) {
    std::ranges::copy(end_[ear].taps, start_[ear].taps.begin());
  }
}

void Ears::Silence() noexcept {
  for (std::vector<float>& signal : signals_) std::ranges::fill(signal, 0.0F);
}

void Ears::Filter(size_t ear, std::span<float> sound) noexcept {
  std::vector<float>& signal = signals_[ear];
  convolution_kernel::Convolve(start_[ear].taps, signal, sound);
  if (start_[ear].taps != end_[ear].taps) {
    convolution_kernel::Convolve(end_[ear].taps, signal, other_);
    const float step = 1 / static_cast<float>(sound.size());
    for (size_t n = 0; n < sound.size(); ++n) {
      sound[n] += static_cast<float>(n) * step * (other_[n] - sound[n]);
    }
  }
  std::copy(signal.end() - static_cast<std::ptrdiff_t>(past_count()), signal.end(), signal.begin());
  known_[ear] = true;
}

}  // namespace carillon
