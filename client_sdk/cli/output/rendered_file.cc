// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/output/rendered_file.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <utility>

namespace carillon::cli {

RenderedFile::RenderedFile(RenderedForm form)
    : form_(std::move(form)),
      factor_(form_.factor),
      loudness_(form_.format.sample_rate_hz, form_.format.channel_count) {}

bool RenderedFile::Take(const client::AudioBlock& block) {
  if (!file_) Begin();
  samples_.insert(samples_.end(), block.samples.begin(), block.samples.end());
  if (!form_.normalize && status_.ok()) Write(false);
  return status_.ok();
}

absl::Status RenderedFile::Finish() {
  constexpr double kPeak = 0.9;
  if (form_.frame_count && !file_) Begin();
  if (form_.normalize) {
    samples_.resize(Cut(true));
    float peak = 0;
    for (const float sample : samples_) peak = std::max(peak, std::abs(sample));
    if (peak > 0) factor_ *= kPeak / peak;
  }
  if (file_ && status_.ok()) Write(true);
  if (form_.frame_count && status_.ok()) FillUp();
  return status_.ok() && file_ ? file_->Finish() : status_;
}

void RenderedFile::Describe(v1::RenderSummary& summary) const {
  summary.set_frame_count(frame_count());
  summary.set_peak(clipped_count_ > 0 ? 1 : peak_);
  summary.set_true_peak(loudness_.true_peak());
  summary.clear_integrated_lufs();
  summary.clear_loudest_momentary_lufs();
  if (const auto lufs = loudness_.integrated()) summary.set_integrated_lufs(*lufs);
  if (const auto lufs = loudness_.loudest_momentary()) summary.set_loudest_momentary_lufs(*lufs);
}

void RenderedFile::Begin() {
  auto file = WaveFile::Create(form_.path, form_.format);
  status_ = file.status();
  if (file.ok()) file_ = *std::move(file);
}

size_t RenderedFile::Cut(bool last) {
  if (!form_.frame_count) return samples_.size();
  const uint64_t channels = form_.format.channel_count;
  const uint64_t room = *form_.frame_count * channels - written_count_;
  const uint64_t fade = std::min(form_.fade_frame_count, *form_.frame_count) * channels;
  const uint64_t unfaded = room - std::min(room, fade);
  if (samples_.size() <= room) return last ? samples_.size() : std::min(samples_.size(), unfaded);
  samples_.resize(room);
  if (!cut_) {
    // The gain falls as half a period of a cosine from the first frame of the fade to its end.
    for (uint64_t i = unfaded; i < room; ++i) {
      const uint64_t faded_frames = (i - unfaded) / channels, fade_frames = fade / channels;
      const double part = static_cast<double>(faded_frames) / static_cast<double>(fade_frames);
      samples_[i] *= static_cast<float>(0.5 + 0.5 * std::cos(std::numbers::pi * part));
    }
  }
  cut_ = true;
  return room;
}

void RenderedFile::Write(bool last) {
  const size_t count = Cut(last);
  const std::span<float> ready(samples_.data(), count);
  for (float& sample : ready) {
    sample *= static_cast<float>(factor_);
    peak_ = std::max(peak_, std::abs(sample));
    if (!form_.format.clips() || std::abs(sample) <= 1) continue;
    ++clipped_count_;
    sample = std::copysign(1.0F, sample);
  }
  loudness_.Add(ready);
  status_ = file_->Write(ready);
  written_count_ += count;
  samples_.erase(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(count));
}

void RenderedFile::FillUp() {
  constexpr uint64_t kPiece = 65536;
  const uint64_t wanted = *form_.frame_count * form_.format.channel_count;
  while (written_count_ < wanted && status_.ok()) {
    samples_.assign(static_cast<size_t>(std::min(kPiece, wanted - written_count_)), 0.0F);
    Write(true);
  }
}

}  // namespace carillon::cli
