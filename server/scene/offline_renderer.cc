// SPDX-License-Identifier: Apache-2.0
#include "server/scene/offline_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
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

MixerSettings SettingsOf(const OfflineSettings& settings, SectionThreads& threads) {
  // Nothing waits here, so a block takes however many events fall into it.
  return {.sample_rate_hz = static_cast<double>(settings.sample_rate_hz),
          .block_frame_count = OfflineRenderer::kBlockFrameCount,
          .channel_count = settings.channel_count,
          .first_frame = settings.mapping.first_frame,
          .most_streams = 1,
          .most_pending_events = kQueueCapacity,
          .most_events_per_block = kQueueCapacity,
          .threads = &threads};
}

bool IsMove(const MixerEvent& event) {
  return std::holds_alternative<ObjectMove>(event.action) ||
         std::holds_alternative<ListenerMove>(event.action);
}

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
  if (settings.channel_count < 1 || settings.channel_count > 2) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
        absl::StrCat("channel_count is ", settings.channel_count, "; it must be 1 or 2"));
  }
  if (absl::Status status = Validate(settings.space); !status.ok()) return status;
  std::unique_ptr<OfflineRenderer> renderer(new OfflineRenderer(settings, bodies));
  absl::StatusOr<std::unique_ptr<EventStream>> stream = renderer->mixer_.OpenStream(kQueueCapacity);
  if (!stream.ok()) return stream.status();
  renderer->stream_ = *std::move(stream);
  return renderer;
}

OfflineRenderer::OfflineRenderer(const OfflineSettings& settings, BodyCache& bodies)
    : settings_(settings),
      bodies_(bodies),
      threads_(settings.thread_count),
      mixer_(SettingsOf(settings, threads_)),
      forces_(settings.step_s),
      pose_times_(settings.step_s) {}

absl::Status OfflineRenderer::AddObject(uint32_t handle, std::shared_ptr<const ModalModel> model,
                                        const ObjectProperties& properties) {
  if (objects_.contains(handle)) {
    return Refusal(absl::StatusCode::kAlreadyExists, "OBJECT_EXISTS",
                   absl::StrCat("the trace has two objects ", handle));
  }
  absl::StatusOr<std::shared_ptr<const SoundingBody>> body = bodies_.Get(std::move(model));
  if (!body.ok()) return body.status();
  absl::StatusOr<SoundingObject> object =
      MakeSoundingObject(*std::move(body), properties, mixer_,
                         MakeVoice(settings_.space, properties.pose, mixer_.settings()));
  if (!object.ok()) return object.status();
  objects_.emplace(handle, *std::move(object));
  return absl::OkStatus();
}

void OfflineRenderer::Strike(const ObjectImpulse& impulse) {
  if (!TryStrike(impulse).ok()) Reject(impulse.second ? 2 : 1);
}

absl::Status OfflineRenderer::TryStrike(const ObjectImpulse& impulse) {
  const double due_s = step_time_s_ + impulse.time_offset_s;
  if (!(impulse.time_offset_s >= 0 && due_s >= settings_.mapping.first_time_s &&
        due_s <= kMaxTimeS)) {
    return absl::InvalidArgumentError("no such time");
  }
  const absl::StatusOr<FeltContact> contact =
      Locate(impulse.handle, impulse.impulse, impulse.second);
  if (!contact.ok()) return contact.status();
  for (const Felt& felt : contact->all()) {
    Push(felt.bank, felt.impulse, due_s);
  }
  return absl::OkStatus();
}

void OfflineRenderer::BeginStep(double time_s) {
  step_time_s_ = time_s;
  forces_.Begin(time_s, [this](auto... force) { PushForce(force...); });
}

void OfflineRenderer::Hold(const ObjectForce& force) {
  const absl::StatusOr<FeltContact> felt = Locate(force.handle, force.force, force.second);
  if (!felt.ok() || !Validate(force.roughness).ok()) return Reject(force.second ? 2 : 1);
  forces_.Add(*felt, force.roughness);
}

void OfflineRenderer::Touch(const ObjectTouch& touch) {
  const absl::StatusOr<FeltContact> felt = Locate(touch.handle, touch.impulse, touch.second);
  if (!felt.ok() || !Validate(touch.roughness).ok()) return Reject(touch.second ? 2 : 1);
  forces_.Touch(touch, *felt);
}

void OfflineRenderer::Move(uint32_t handle, const Pose& pose) {
  const auto found = objects_.find(handle);
  if (found == objects_.end() || !Validate(pose).ok()) return Reject(1);
  SoundingObject& object = found->second;
  object.properties.pose = pose;
  if (object.voice == nullptr) return;
  const double glide_s = pose_times_.GlideS(handle, step_time_s_);
  Push(object.bank, ObjectMove{MotionTo(pose, glide_s * settings_.sample_rate_hz)},
       step_time_s_ - glide_s);
}

void OfflineRenderer::MoveListener(const Pose& pose) {
  if (!Validate(pose).ok()) return Reject(1);
  const double glide_s = pose_times_.GlideS(std::nullopt, step_time_s_);
  for (const auto& [handle, object] : objects_) {
    if (object.voice == nullptr) continue;
    Push(object.bank, ListenerMove{MotionTo(pose, glide_s * settings_.sample_rate_hz)},
         step_time_s_ - glide_s);
  }
}

void OfflineRenderer::EndStep() {
  forces_.End([this](auto... force) { PushForce(force...); });
}

void OfflineRenderer::PushForce(uint32_t handle, const MixerEvent::Action& action, double time_s) {
  Push(objects_.at(handle).bank, action, time_s);
}

absl::StatusOr<FeltContact> OfflineRenderer::Locate(
    uint32_t handle, const ContactImpulse& contact,
    const std::optional<SecondObject>& second) const {
  const auto found = objects_.find(handle);
  const auto other = second ? objects_.find(second->handle) : found;
  if (found == objects_.end() || other == objects_.end()) {
    return absl::InvalidArgumentError("no such object");
  }
  return second ? Feel(contact, handle, found->second, *second, other->second)
                : Feel(contact, handle, found->second);
}

void OfflineRenderer::Push(BankId bank, const MixerEvent::Action& action, double time_s) {
  MixerEvent event{.bank = bank, .action = action};
  SetFrame(event, settings_.mapping.FrameOf(time_s, settings_.sample_rate_hz));
  events_.push_back(event);
}

size_t OfflineRenderer::Render(std::span<float> samples) {
  if (!begun_) {
    // Events of one sample keep their order, as when they come live.
    std::ranges::stable_sort(events_, {}, &MixerEvent::FirstSample);
    const auto last = std::find_if_not(events_.rbegin(), events_.rend(), IsMove);
    contact_count_ = static_cast<size_t>(events_.rend() - last);
  }
  begun_ = true;
  const FlushDenormals flush;
  size_t count = 0;
  while (!ended_ && (count + kBlockFrameCount) * settings_.channel_count <= samples.size()) {
    count += RenderBlocks(samples.subspan(count * settings_.channel_count));
  }
  return count;
}

/// Renders some of `samples`; returns how many frames count.
size_t OfflineRenderer::RenderBlocks(std::span<float> samples) {
  const size_t block_size = kBlockFrameCount * settings_.channel_count;
  const size_t block_count = CountBlocks(samples.size() / block_size);
  samples = samples.first(block_count * block_size);
  const uint64_t first = mixer_.frame();
  size_t count = block_count * kBlockFrameCount;
  PushEventsBefore(first + count);
  mixer_.Render(samples);
  mixer_.CollectGarbage();
  if (pushed_count_ >= contact_count_) {
    count =
        static_cast<size_t>(std::min<uint64_t>(count, EndFrame() - std::min(first, EndFrame())));
    for (size_t n = 0; n < count && !ended_; n += kBlockFrameCount) {
      ended_ = TailEnded(samples.subspan(n * settings_.channel_count, block_size));
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
  while (count > 1 && full < events_.size() &&
         events_[full].FirstSample() < first + count * kBlockFrameCount) {
    --count;
  }
  return count;
}

uint64_t OfflineRenderer::EndFrame() const {
  const uint64_t last = contact_count_ == 0 ? settings_.mapping.first_frame
                                            : events_[contact_count_ - 1].FirstSample();
  const double tail_s = settings_.tail_s > 0 ? settings_.tail_s : kLongestOpenTailS;
  return last + static_cast<uint64_t>(std::ceil(tail_s * settings_.sample_rate_hz));
}

void OfflineRenderer::PushEventsBefore(uint64_t frame) {
  while (pushed_count_ < events_.size() && events_[pushed_count_].FirstSample() < frame) {
    if (!stream_->TryPush(events_[pushed_count_])) Reject(1);
    ++pushed_count_;
  }
}

bool OfflineRenderer::TailEnded(std::span<const float> block) {
  const bool quiet = std::ranges::all_of(block, [](float x) { return std::abs(x) < kQuiet; });
  quiet_frame_count_ = quiet ? quiet_frame_count_ + kBlockFrameCount : 0;
  return settings_.tail_s == 0 &&
         static_cast<double>(quiet_frame_count_) >= QuietS() * settings_.sample_rate_hz;
}

/// What is on its way may still arrive.
double OfflineRenderer::QuietS() const {
  return kQuietS + (settings_.space.hearing.propagation_delay ? kLongestPropagationS : 0);
}

}  // namespace carillon
