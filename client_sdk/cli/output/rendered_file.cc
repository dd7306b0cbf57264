// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/output/rendered_file.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace carillon::cli {

RenderedFile::RenderedFile(RenderedForm form) : form_(std::move(form)), factor_(form_.factor) {}

bool RenderedFile::Take(const client::AudioBlock& block) {
  if (!file_) Begin();
  samples_.insert(samples_.end(), block.samples.begin(), block.samples.end());
  if (!form_.normalize && status_.ok()) Write();
  return status_.ok();
}

absl::Status RenderedFile::Finish() {
  constexpr double kPeak = 0.9;
  if (form_.frame_count && !file_) Begin();
  if (form_.normalize) {
    float peak = 0;
    for (const float sample : samples_) peak = std::max(peak, std::abs(sample));
    if (peak > 0) factor_ *= kPeak / peak;
    if (file_ && status_.ok()) Write();
  }
  if (form_.frame_count && status_.ok()) FillUp();
  return status_.ok() && file_ ? file_->Finish() : status_;
}

void RenderedFile::Begin() {
  auto file = WaveFile::Create(form_.path, form_.format);
  status_ = file.status();
  if (file.ok()) file_ = *std::move(file);
}

void RenderedFile::Write() {
  if (form_.frame_count) {
    const uint64_t wanted = *form_.frame_count * form_.format.channel_count - written_count_;
    samples_.resize(static_cast<size_t>(std::min<uint64_t>(samples_.size(), wanted)));
  }
  for (float& sample : samples_) {
    sample *= static_cast<float>(factor_);
    peak_ = std::max(peak_, std::abs(sample));
    if (form_.format.clips() && std::abs(sample) > 1) ++clipped_count_;
  }
  status_ = file_->Write(samples_);
  written_count_ += samples_.size();
  samples_.clear();
}

void RenderedFile::FillUp() {
  constexpr uint64_t kPiece = 65536;
  const uint64_t wanted = *form_.frame_count * form_.format.channel_count;
  while (written_count_ < wanted && status_.ok()) {
    samples_.assign(static_cast<size_t>(std::min(kPiece, wanted - written_count_)), 0.0F);
    Write();
  }
}

}  // namespace carillon::cli
