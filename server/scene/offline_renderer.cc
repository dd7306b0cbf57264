// SPDX-License-Identifier: Apache-2.0
#include "server/scene/offline_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/error_reason.h"
#include "server/synthesis/flush_denormals.h"

namespace carillon {
namespace {

constexpr uint32_t kLowestRateHz = 8000;
constexpr uint32_t kHighestRateHz = 192000;
constexpr double kLongestTailS = 120;
constexpr double kLongestOpenTailS = 60;
/// -80 dB of full scale.
constexpr float kQuiet = 1e-4F;
/// So long must it stay quiet: two close modes beat, and are silent together for a while.
constexpr double kQuietS = 0.25;
constexpr size_t kQueueCapacity = 65536;

MixerSettings SettingsOf(const OfflineSettings& settings, SectionCrew& crew) {
  // Nothing waits here, so a block takes however many strikes fall into it.
  return {.sample_rate_hz = static_cast<double>(settings.sample_rate_hz),
          .block_frame_count = OfflineRenderer::kBlockFrameCount,
          .first_frame = settings.mapping.first_frame,
          .most_streams = 1,
          .most_pending_strikes = kQueueCapacity,
          .most_strikes_per_block = kQueueCapacity,
          .crew = &crew};
}

/// Strikes of one sample keep their order, as when they come live.
bool Earlier(const Strike& a, const Strike& b) { return FirstSample(a) < FirstSample(b); }

}  // namespace

absl::StatusOr<std::unique_ptr<OfflineRenderer>> OfflineRenderer::Make(
    const OfflineSettings& settings, BodyCache& bodies) {
  if (settings.sample_rate_hz < kLowestRateHz || settings.sample_rate_hz > kHighestRateHz) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   absl::StrCat("sample_rate_hz is ", settings.sample_rate_hz, "; it must be ",
                                kLowestRateHz, " to ", kHighestRateHz));
  }
  if (!(settings.tail_s >= 0 && settings.tail_s <= kLongestTailS)) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
        absl::StrCat("tail_s is ", settings.tail_s, "; it must be 0 to ", kLongestTailS));
  }
  std::unique_ptr<OfflineRenderer> renderer(new OfflineRenderer(settings, bodies));
  absl::StatusOr<std::unique_ptr<StrikeStream>> stream =
      renderer->mixer_.OpenStream(kQueueCapacity);
  if (!stream.ok()) return stream.status();
  renderer->stream_ = *std::move(stream);
  return renderer;
}

OfflineRenderer::OfflineRenderer(const OfflineSettings& settings, BodyCache& bodies)
    : settings_(settings),
      bodies_(bodies),
      crew_(settings.thread_count),
      mixer_(SettingsOf(settings, crew_)),
      forces_(settings.step_s) {}

absl::Status OfflineRenderer::AddObject(uint32_t handle, std::shared_ptr<const ModalModel> model,
                                        const ObjectProperties& properties) {
  if (objects_.contains(handle)) {
    return Refusal(absl::StatusCode::kAlreadyExists, "OBJECT_EXISTS",
                   absl::StrCat("the trace has two objects ", handle));
  }
  absl::StatusOr<std::shared_ptr<const SoundingBody>> body = bodies_.Get(std::move(model));
  if (!body.ok()) return body.status();
  absl::StatusOr<SoundingObject> object = MakeSoundingObject(*std::move(body), properties, mixer_);
  if (!object.ok()) return object.status();
  objects_.emplace(handle, *std::move(object));
  return absl::OkStatus();
}

void OfflineRenderer::Strike(const ObjectImpulse& impulse) {
  if (!TryStrike(impulse).ok()) Reject(1);
}

absl::Status OfflineRenderer::TryStrike(const ObjectImpulse& impulse) {
  const double due_s = step_time_s_ + impulse.time_offset_s;
  if (!(impulse.time_offset_s >= 0 && due_s >= settings_.mapping.first_time_s &&
        due_s <= kMaxTimeS)) {
    return absl::InvalidArgumentError("no such time");
  }
  absl::StatusOr<Excitation> excitation = Locate(impulse.handle, impulse.impulse);
  if (!excitation.ok()) return excitation.status();
  Push({.bank = objects_.at(impulse.handle).bank, .excitation = *excitation}, due_s);
  return absl::OkStatus();
}

void OfflineRenderer::BeginStep(double time_s) {
  step_time_s_ = time_s;
  forces_.Begin(time_s, [this](auto... force) { PushForce(force...); });
}

void OfflineRenderer::Hold(const ObjectForce& force) {
  const absl::StatusOr<Excitation> excitation = Locate(force.handle, force.force);
  if (!excitation.ok() || !Validate(force.roughness).ok()) return Reject(1);
  forces_.Add(force.handle, *excitation, force.roughness);
}

void OfflineRenderer::Touch(const ObjectTouch& touch) {
  const absl::StatusOr<Excitation> excitation = Locate(touch.handle, touch.impulse);
  if (!excitation.ok() || !Validate(touch.roughness).ok()) return Reject(1);
  forces_.Touch(touch, *excitation);
}

void OfflineRenderer::EndStep() {
  forces_.End([this](auto... force) { PushForce(force...); });
}

void OfflineRenderer::PushForce(uint32_t handle, carillon::Strike strike, double time_s) {
  strike.bank = objects_.at(handle).bank;
  Push(strike, time_s);
}

absl::StatusOr<Excitation> OfflineRenderer::Locate(uint32_t handle,
                                                   const ContactImpulse& contact) const {
  const auto found = objects_.find(handle);
  if (found == objects_.end()) return absl::InvalidArgumentError("no such object");
  return LocateImpulse(found->second, contact);
}

void OfflineRenderer::Push(carillon::Strike strike, double time_s) {
  SetFrame(strike, settings_.mapping.FrameOf(time_s, settings_.sample_rate_hz));
  strikes_.push_back(strike);
}

size_t OfflineRenderer::Render(std::span<float> frames) {
  if (!begun_) std::ranges::stable_sort(strikes_, Earlier);
  begun_ = true;
  const FlushDenormals flush;
  size_t count = 0;
  while (!ended_ && count + kBlockFrameCount <= frames.size()) {
    count += RenderBlocks(frames.subspan(count));
  }
  return count;
}

/// Renders some of `frames`; returns how many count.
size_t OfflineRenderer::RenderBlocks(std::span<float> frames) {
  frames = frames.first(CountBlocks(frames.size() / kBlockFrameCount) * kBlockFrameCount);
  const uint64_t first = mixer_.frame();
  PushStrikesBefore(first + frames.size());
  mixer_.Render(frames);
  mixer_.CollectGarbage();
  size_t count = frames.size();
  if (pushed_count_ == strikes_.size()) {
    count =
        static_cast<size_t>(std::min<uint64_t>(count, EndFrame() - std::min(first, EndFrame())));
    for (size_t n = 0; n < count && !ended_; n += kBlockFrameCount) {
      ended_ = TailEnded(frames.subspan(n, kBlockFrameCount));
      if (ended_) count = std::min(count, n + kBlockFrameCount);
    }
    ended_ = ended_ || mixer_.frame() >= EndFrame();
  }
  const MixerStatistics statistics = mixer_.statistics();
  summary_.frame_count += count;
  summary_.accepted_count = statistics.accepted_count + statistics.late_count;
  summary_.limited_frame_count = statistics.limited_frame_count;
  summary_.peak = std::max(summary_.peak, mixer_.TakePeak());
  return count;
}

/// How many blocks are rendered together: not past the end, nor more than whose strikes the queue
/// holds.
size_t OfflineRenderer::CountBlocks(size_t most) const {
  const uint64_t first = mixer_.frame();
  const uint64_t left = EndFrame() - std::min(first, EndFrame());
  size_t count = std::min<size_t>({most, kBlocksTogether, left / kBlockFrameCount + 1});
  const size_t full = pushed_count_ + kQueueCapacity / 2;
  while (count > 1 && full < strikes_.size() &&
         FirstSample(strikes_[full]) < first + count * kBlockFrameCount) {
    --count;
  }
  return count;
}

uint64_t OfflineRenderer::EndFrame() const {
  const uint64_t last =
      strikes_.empty() ? settings_.mapping.first_frame : FirstSample(strikes_.back());
  const double tail_s = settings_.tail_s > 0 ? settings_.tail_s : kLongestOpenTailS;
  return last + static_cast<uint64_t>(std::ceil(tail_s * settings_.sample_rate_hz));
}

void OfflineRenderer::PushStrikesBefore(uint64_t frame) {
  while (pushed_count_ < strikes_.size() && FirstSample(strikes_[pushed_count_]) < frame) {
    if (!stream_->TryPush(strikes_[pushed_count_])) Reject(1);
    ++pushed_count_;
  }
}

bool OfflineRenderer::TailEnded(std::span<const float> block) {
  const bool quiet = std::ranges::all_of(block, [](float x) { return std::abs(x) < kQuiet; });
  quiet_frame_count_ = quiet ? quiet_frame_count_ + block.size() : 0;
  return settings_.tail_s == 0 &&
         static_cast<double>(quiet_frame_count_) >= kQuietS * settings_.sample_rate_hz;
}

}  // namespace carillon
