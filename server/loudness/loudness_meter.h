// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

namespace carillon {

/// Measures the loudness of a sound after EBU R 128 (ITU-R BS.1770) while the sound is added. A
/// loudness is absent if the sound is below -70 LUFS or, for the integrated loudness, shorter than
/// 400 ms. The meter allocates now and then, so it must not run on an audio thread. One thread at a
/// time.
class LoudnessMeter {
 public:
  LoudnessMeter(uint32_t sample_rate_hz, uint32_t channel_count);
  ~LoudnessMeter();
  LoudnessMeter(const LoudnessMeter&) = delete;
  LoudnessMeter& operator=(const LoudnessMeter&) = delete;

  /// Adds interleaved frames.
  void Add(std::span<const float> samples);

  /// Loudness of the last 400 ms, LUFS.
  std::optional<double> momentary() const;
  /// Loudness of the last 3 s, LUFS.
  std::optional<double> short_term() const;
  /// Loudness of the whole sound, gated as R 128 says, LUFS.
  std::optional<double> integrated() const;
  /// The loudest momentary loudness so far, LUFS, in steps of 100 ms.
  std::optional<double> loudest_momentary() const { return loudest_momentary_; }
  /// Returns the largest sample so far in any channel of the sound oversampled four times; full
  /// scale is 1.
  double true_peak() const;

 private:
  class Library;

  const uint32_t channel_count_;
  const size_t step_size_;  ///< samples of 100 ms
  const std::unique_ptr<Library> library_;
  size_t samples_to_step_;
  std::optional<double> loudest_momentary_;
};

}  // namespace carillon
