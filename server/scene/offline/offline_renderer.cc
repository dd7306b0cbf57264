// SPDX-License-Identifier: Apache-2.0
#include "server/scene/offline/offline_renderer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/synthesis/voice/voice.h"

namespace carillon {
namespace {

constexpr double kLongestTailS = 120;
constexpr double kLongestOpenTailS = 60;
constexpr double kMostLongestS = 1e5;
/// The sound has ended below -80 dB of full scale, if that is also 60 dB below its peak.
constexpr float kQuiet = 1e-4F;
constexpr float kQuietOfPeak = 1e-3F;
/// The sound must stay quiet for this time, because two modes that beat are silent together for a
/// while.
constexpr double kQuietS = 0.25;
/// The sound that is left at the end fades out over this time, because a cut clicks.
constexpr double kFadeS = 0.01;

bool IsSilent(std::span<const float> samples) {
  return std::ranges::all_of(samples, [](float x) { return x == 0; });
}

}  // namespace

absl::StatusOr<std::unique_ptr<OfflineRenderer>> OfflineRenderer::Make(
    const OfflineSettings& settings, BodyCache& bodies, TransferStore* transfers) {
  if (!(settings.tail_s >= 0 && settings.tail_s <= kLongestTailS)) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
        absl::StrCat("tail_s is ", settings.tail_s, "; it must be 0 to ", kLongestTailS));
  }
  if (!(settings.longest_s >= 0 && settings.longest_s <= kMostLongestS)) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
        absl::StrCat("longest_s is ", settings.longest_s, "; it must be 0 to ", kMostLongestS));
  }
  ASSIGN_OR_RETURN(std::unique_ptr<ForwardRenderer> forward,
                   ForwardRenderer::Make(settings, bodies, transfers));
  return std::unique_ptr<OfflineRenderer>(new OfflineRenderer(std::move(forward)));
}

size_t OfflineRenderer::Render(std::span<float> samples) {
  const size_t channel_count = forward_->settings().channel_count;
  const size_t room = samples.size() / channel_count;
  size_t given = 0;
  if (may_have_ended_ && forward_->last_contact_frame() != contact_frame_) {
    may_have_ended_ = false;
    quiet_frame_count_ = 0;
  }
  if (!may_have_ended_ || ended_) given = GiveHeld(samples);
  while (!ended_ && (held_.empty() || may_have_ended_)) {
    if (may_have_ended_ && forward_->finished() && HeldFrames() >= FadeFrames()) {
      FadeHeld();
      given += GiveHeld(samples.subspan(given * channel_count));
      break;
    }
    const size_t count = CountReady((room - given) / kBlockFrameCount);
    if (count == 0) break;
    const size_t first = given;
    forward_->Render(
        samples.subspan(given * channel_count, count * kBlockFrameCount * channel_count));
    for (size_t block = 0; block < count; ++block) {
      const size_t start = first + block * kBlockFrameCount;
      given += KeepBlock(samples.subspan(start * channel_count, kBlockFrameCount * channel_count),
                         forward_->frame() - (count - block) * kBlockFrameCount);
    }
  }
  peak_ = std::max(peak_, forward_->TakePeak());
  frame_count_ += given;
  return given;
}

/// Returns how many of the next `most` blocks can be rendered together.
size_t OfflineRenderer::CountReady(size_t most) const {
  const uint64_t frame = forward_->frame();
  const uint64_t settled = forward_->settled_frame();
  uint64_t count = settled <= frame ? 0 : (settled - frame) / kBlockFrameCount;
  // What lies after the end need not be rendered.
  if (forward_->finished()) {
    count = std::min(count, (EndFrame() - std::min(frame, EndFrame())) / kBlockFrameCount + 1);
  }
  return std::min<uint64_t>({count, most, kBlocksTogether});
}

/// Returns the number of frames of a block that belong to the sound, and keeps the others back.
/// `frame` is the number of the block's first frame.
size_t OfflineRenderer::KeepBlock(std::span<const float> block, uint64_t frame) {
  size_t count = 0;
  for (const float x : block) loudest_ = std::max(loudest_, std::abs(x));
  if (!may_have_ended_) {
    const uint64_t left = EndFrame() - std::min(frame, EndFrame());
    count = static_cast<size_t>(std::min<uint64_t>(kBlockFrameCount, left));
    may_have_ended_ = left <= kBlockFrameCount || StaysQuiet(block, frame);
    contact_frame_ = forward_->last_contact_frame();
  }
  Hold(block.subspan(count * forward_->settings().channel_count));
  return count;
}

/// Returns whether the sound has been quiet for so long since the last contact that it ends with
/// this block.
bool OfflineRenderer::StaysQuiet(std::span<const float> block, uint64_t frame) {
  const OfflineSettings& settings = forward_->settings();
  const float least = std::min(kQuiet, kQuietOfPeak * loudest_);
  const bool quiet = frame + kBlockFrameCount > forward_->last_contact_frame() &&
                     std::ranges::all_of(block, [&](float x) { return std::abs(x) <= least; });
  quiet_frame_count_ = quiet ? quiet_frame_count_ + kBlockFrameCount : 0;
  // Sound may still be on its way to the listener.
  const double delay_s = settings.space.hearing.propagation_delay ? kLongestPropagationS : 0;
  return settings.tail_s == 0 &&
         static_cast<double>(quiet_frame_count_) >= (kQuietS + delay_s) * settings.sample_rate_hz;
}

/// Returns the frame at which the fade begins at the latest. A tail that is given includes it.
uint64_t OfflineRenderer::EndFrame() const {
  const OfflineSettings& settings = forward_->settings();
  const bool is_given = settings.tail_s > 0;
  const double tail_s = is_given ? settings.tail_s : kLongestOpenTailS;
  const uint64_t contact = forward_->last_contact_frame();
  const uint64_t end = contact +
                       static_cast<uint64_t>(std::ceil(tail_s * settings.sample_rate_hz)) -
                       (is_given ? FadeFrames() : 0);
  if (settings.longest_s == 0) return end;
  const uint64_t longest =
      settings.mapping.first_frame +
      static_cast<uint64_t>(std::ceil(settings.longest_s * settings.sample_rate_hz));
  return std::min(end, std::max(contact, longest));
}

size_t OfflineRenderer::FadeFrames() const {
  const OfflineSettings& settings = forward_->settings();
  const double fade_s = settings.tail_s > 0 ? std::min(kFadeS, settings.tail_s) : kFadeS;
  return static_cast<size_t>(std::ceil(fade_s * settings.sample_rate_hz));
}

/// Lets the frames that were kept back fade out, and drops those after the fade.
void OfflineRenderer::FadeHeld() {
  const size_t channel_count = forward_->settings().channel_count;
  const size_t fade = FadeFrames();
  size_t faded = 0;
  for (Held& held : held_) {
    held.frame_count = std::min(held.frame_count, fade - faded);
    held.samples.resize(std::min(held.samples.size(), held.frame_count * channel_count));
    for (size_t i = 0; i < held.samples.size(); ++i) {
      const size_t frame = faded + i / channel_count;
      const double part = static_cast<double>(frame) / static_cast<double>(fade);
      held.samples[i] *= static_cast<float>(0.5 + 0.5 * std::cos(std::numbers::pi * part));
    }
    faded += held.frame_count;
  }
  ended_ = true;
}

void OfflineRenderer::Hold(std::span<const float> samples) {
  if (samples.empty()) return;
  const size_t frame_count = samples.size() / forward_->settings().channel_count;
  if (!IsSilent(samples)) {
    held_.push_back({{samples.begin(), samples.end()}, frame_count});
  } else if (!held_.empty() && held_.back().samples.empty()) {
    held_.back().frame_count += frame_count;
  } else {
    held_.push_back({{}, frame_count});
  }
}

/// Moves frames that were kept back into `samples`. Returns their number.
size_t OfflineRenderer::GiveHeld(std::span<float> samples) {
  const size_t channel_count = forward_->settings().channel_count;
  const size_t room = samples.size() / channel_count;
  size_t given = 0;
  while (!held_.empty()) {
    Held& held = held_.front();
    const auto to = samples.subspan(given * channel_count);
    if (held.samples.empty()) {
      const size_t count = std::min(held.frame_count, room - given);
      std::ranges::fill(to.first(count * channel_count), 0.0F);
      held.frame_count -= count;
      given += count;
    } else if (held.frame_count <= room - given) {
      std::ranges::copy(held.samples, to.begin());
      given += std::exchange(held.frame_count, 0);
    }
    if (held.frame_count > 0) break;
    held_.pop_front();
  }
  return given;
}

size_t OfflineRenderer::HeldFrames() const {
  size_t count = 0;
  for (const Held& held : held_) count += held.frame_count;
  return count;
}

size_t OfflineRenderer::held_bytes() const {
  size_t bytes = held_.size() * sizeof(Held);
  for (const Held& held : held_) bytes += held.samples.capacity() * sizeof(float);
  return bytes;
}

OfflineSummary OfflineRenderer::summary() const {
  const MixerStatistics statistics = forward_->statistics();
  const ContactIntake& intake = forward_->intake();
  return {.frame_count = frame_count_,
          .accepted_count = statistics.accepted_count + statistics.late_count,
          .rejected_count = intake.rejected_count(),
          .last_rejection = intake.last_rejection(),
          .peak = peak_,
          .limited_frame_count = statistics.limited_frame_count,
          .findings = intake.findings(),
          .paper_coupling_object_count = forward_->paper_coupling_object_count()};
}

}  // namespace carillon
