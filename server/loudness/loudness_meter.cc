// SPDX-License-Identifier: Apache-2.0
#include "server/loudness/loudness_meter.h"

#include <ebur128.h>

#include <algorithm>

namespace carillon {
namespace {

/// The absolute gate of R 128: what is quieter counts as silence.
constexpr double kSilenceLufs = -70;

/// The histogram keeps the memory for the integrated loudness constant, however long the sound is.
constexpr int kModes =
    EBUR128_MODE_S | EBUR128_MODE_I | EBUR128_MODE_TRUE_PEAK | EBUR128_MODE_HISTOGRAM;

}  // namespace

/// Owns the state of the library, whose type has no name that a header could declare.
class LoudnessMeter::Library {
 public:
  Library(uint32_t sample_rate_hz, uint32_t channel_count)
      : state_(ebur128_init(channel_count, sample_rate_hz, kModes)) {}
  ~Library() { ebur128_destroy(&state_); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  ebur128_state* state() const { return state_; }

  std::optional<double> Measure(int (*measure)(ebur128_state*, double*)) const {
    double lufs = 0;
    if (measure(state_, &lufs) != EBUR128_SUCCESS || lufs < kSilenceLufs) return std::nullopt;
    return lufs;
  }

 private:
  ebur128_state* state_;
};

LoudnessMeter::LoudnessMeter(uint32_t sample_rate_hz, uint32_t channel_count)
    : channel_count_(channel_count),
      step_size_(size_t{sample_rate_hz} / 10 * channel_count),
      library_(std::make_unique<Library>(sample_rate_hz, channel_count)),
      samples_to_step_(step_size_) {
  // One channel is heard on both loudspeakers, as a mono file is played.
  if (channel_count == 1) ebur128_set_channel(library_->state(), 0, EBUR128_DUAL_MONO);
}

LoudnessMeter::~LoudnessMeter() = default;

void LoudnessMeter::Add(std::span<const float> samples) {
  while (!samples.empty()) {
    const size_t count = std::min(samples.size(), samples_to_step_);
    ebur128_add_frames_float(library_->state(), samples.data(), count / channel_count_);
    samples = samples.subspan(count);
    samples_to_step_ -= count;
    if (samples_to_step_ > 0) continue;
    samples_to_step_ = step_size_;
    loudest_momentary_ = std::max(loudest_momentary_, momentary());
  }
}

std::optional<double> LoudnessMeter::momentary() const {
  return library_->Measure(ebur128_loudness_momentary);
}

std::optional<double> LoudnessMeter::short_term() const {
  return library_->Measure(ebur128_loudness_shortterm);
}

std::optional<double> LoudnessMeter::integrated() const {
  return library_->Measure(ebur128_loudness_global);
}

double LoudnessMeter::true_peak() const {
  double largest = 0;
  for (uint32_t channel = 0; channel < channel_count_; ++channel) {
    double peak = 0;
    if (ebur128_true_peak(library_->state(), channel, &peak) == EBUR128_SUCCESS) {
      largest = std::max(largest, peak);
    }
  }
  return largest;
}

}  // namespace carillon
