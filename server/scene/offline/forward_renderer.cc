// SPDX-License-Identifier: Apache-2.0
#include "server/scene/offline/forward_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/scene/scene_volumes.h"

namespace carillon {
namespace {

constexpr uint32_t kLowestRateHz = 8000;
constexpr uint32_t kHighestRateHz = 192000;
/// With the beginnings of contacts, and those whose contacts begin soon, several times the events
/// of a block wait in the mixer.
constexpr size_t kPendingPerEvent = 4;
/// Longest time from the beginning of a contact to its middle (AccelerationNoise::PulseFrames).
constexpr double kLongestLeadS = 0.075;
/// Memory that an object takes beside its model, and for each of its modes that sound.
constexpr size_t kObjectBytes = size_t{40} << 10U;
constexpr size_t kModeBytes = 80;

MixerSettings SettingsOf(const OfflineSettings& settings, RenderThreads& threads) {
  // Offline blocks have no deadline, so a block takes all its events.
  return {.sample_rate_hz = static_cast<double>(settings.sample_rate_hz),
          .block_frame_count = settings.size.block_frame_count,
          .channel_count = settings.channel_count,
          .first_frame = settings.mapping.first_frame,
          .most_banks = settings.size.most_objects,
          .most_buses = 1,
          .stagger = settings.stagger,
          .most_streams = 1,
          .most_pending_events = kPendingPerEvent * settings.size.most_events,
          .most_events_per_block = settings.size.most_events,
          .gain = settings.gain,
          .full_scale_pa = settings.full_scale_pa,
          .limits = !settings.is_observation,
          .shares_workspace = settings.is_observation,
          .threads = settings.thread_count > 1 ? &threads : nullptr};
}

IntakeSettings IntakeSettingsOf(const OfflineSettings& settings, std::vector<BlowRecord>& blows) {
  return {.sample_rate_hz = static_cast<double>(settings.sample_rate_hz),
          .step_s = settings.step_s,
          .mapping = settings.mapping,
          .most_ahead_s = ForwardRenderer::kMaxDurationS,
          .reading = settings.reading,
          .blows = settings.tells_blows ? &blows : nullptr,
          .balances = settings.balances};
}

bool IsMove(const MixerEvent& event) {
  return std::holds_alternative<ObjectMove>(event.action) ||
         std::holds_alternative<ListenerMove>(event.action);
}

absl::Status OutOfRange(absl::string_view what, double value, double least, double most) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                 absl::StrCat(what, " is ", value, "; it must be ", least, " to ", most));
}

}  // namespace

absl::StatusOr<std::unique_ptr<ForwardRenderer>> ForwardRenderer::Make(
    const OfflineSettings& settings, BodyCache& bodies, TransferStore* transfers) {
  if (settings.sample_rate_hz < kLowestRateHz || settings.sample_rate_hz > kHighestRateHz) {
    return OutOfRange("sample_rate_hz", settings.sample_rate_hz, kLowestRateHz, kHighestRateHz);
  }
  if (settings.channel_count < 1 ||
      (settings.channel_count > 2 && !settings.space.hearing.ambisonic)) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
        absl::StrCat("channel_count is ", settings.channel_count, "; it must be 1 or 2"));
  }
  RETURN_IF_ERROR(ValidateGain(settings.gain));
  if (!(settings.full_scale_pa >= kLeastFullScalePa &&
        settings.full_scale_pa <= kMostFullScalePa)) {
    return OutOfRange("full_scale_pa", settings.full_scale_pa, kLeastFullScalePa, kMostFullScalePa);
  }
  RETURN_IF_ERROR(Validate(settings.space));
  std::unique_ptr<ForwardRenderer> renderer(new ForwardRenderer(settings, bodies, transfers));
  ASSIGN_OR_RETURN(renderer->stream_, renderer->mixer_.OpenStream(settings.size.most_events));
  return renderer;
}

ForwardRenderer::ForwardRenderer(const OfflineSettings& settings, BodyCache& bodies,
                                 TransferStore* transfers)
    : settings_(settings),
      bodies_(bodies),
      transfers_(transfers),
      threads_(settings.thread_count),
      mixer_(SettingsOf(settings, threads_)),
      scene_(settings.is_observation ? "the environment" : "the trace", settings.space),
      target_(settings.mapping.first_frame),
      intake_(scene_, target_, IntakeSettingsOf(settings, blows_)) {}

absl::Status ForwardRenderer::AddObject(uint32_t handle, std::shared_ptr<const ModalModel> model,
                                        const ObjectProperties& properties,
                                        const std::shared_ptr<const Transfer>* chosen) {
  RETURN_IF_ERROR(scene_.CheckFree(handle));
  ASSIGN_OR_RETURN(std::shared_ptr<const SoundingBody> body, bodies_.Get(std::move(model)));
  auto voice = MakeVoice(settings_.space, properties.pose, mixer_.settings());
  ASSIGN_OR_RETURN(SoundingObject object, MakeSoundingObject(std::move(body), properties, {mixer_},
                                                             std::move(voice), transfers_, chosen));
  if (object.transfer == nullptr && properties.radiation == RadiationModel::kDefault) {
    ++paper_coupling_object_count_;
  }
  object_bytes_ += kObjectBytes + object.mode_count * kModeBytes;
  return scene_.Insert(handle, std::move(object));
}

absl::Status ForwardRenderer::RemoveObject(uint32_t handle) {
  ASSIGN_OR_RETURN(const SoundingObject object, scene_.Remove(handle));
  mixer_.FadeOut(object.bank);
  removed_ = true;
  return absl::OkStatus();
}

std::shared_ptr<const Transfer> ForwardRenderer::TransferOf(uint32_t handle) const {
  const MutexLock lock(&scene_.mutex());
  const absl::StatusOr<const SoundingObject*> object = scene_.Find(handle);
  return object.ok() ? (*object)->transfer : nullptr;
}

std::optional<Pose> ForwardRenderer::PoseOf(uint32_t handle) const {
  const MutexLock lock(&scene_.mutex());
  const absl::StatusOr<const SoundingObject*> object = scene_.Find(handle);
  return object.ok() ? (*object)->properties.pose : std::nullopt;
}

void ForwardRenderer::Finish() {
  intake_.Finish();
  finished_ = true;
}

uint64_t ForwardRenderer::settled_frame() const {
  if (finished_) return std::numeric_limits<uint64_t>::max();
  if (intake_.step_count() == 0) return settings_.mapping.first_frame;
  // A move begins at most one step before the step of its pose. Blows, also those that span several
  // steps, lie at or after the step that makes them known.
  const double back_s = settings_.step_s / intake_.mapping().scale + kLongestLeadS;
  const double frame = intake_.newest_frame() - back_s * settings_.sample_rate_hz - 1;
  return std::max(settings_.mapping.first_frame, static_cast<uint64_t>(std::max(frame, 0.0)));
}

void ForwardRenderer::Target::Push(const MixerEvent& event) {
  if (const SurfaceImpulse* impulse = event.impulse()) {
    longest_contact_s = std::max(longest_contact_s, double{impulse->pulse.duration_s()});
  }
  if (!IsMove(event)) last_contact_frame = std::max(last_contact_frame, event.FirstSample());
  events.Push(event);
}

void ForwardRenderer::Render(std::span<float> samples, RenderWorkspace* workspace) {
  target_.events.Sort();
  const size_t block_size = settings_.size.block_frame_count * settings_.channel_count;
  while (!samples.empty()) {
    const size_t block_count = CountBlocks(samples.size() / block_size);
    const std::span<float> blocks = samples.first(block_count * block_size);
    PushEventsBefore(mixer_.frame() + block_count * settings_.size.block_frame_count);
    if (workspace != nullptr) {
      mixer_.Render(blocks, *workspace);
    } else {
      mixer_.Render(blocks);
    }
    if (removed_) mixer_.CollectGarbage();
    samples = samples.subspan(blocks.size());
  }
  target_.next_frame = mixer_.frame();
  RejectDropped();
}

/// The mixer drops events for which it has no place.
void ForwardRenderer::RejectDropped() {
  const uint64_t dropped_count = mixer_.statistics().dropped_count;
  const uint64_t more = dropped_count - std::exchange(dropped_count_, dropped_count);
  // Those on their way to an object that was removed are lost with the object.
  if (more > 0 && !removed_) intake_.Reject(more, TooManyEvents());
}

absl::Status ForwardRenderer::TooManyEvents() const {
  return Refusal(
      absl::StatusCode::kResourceExhausted, "TOO_MANY_CONTACTS",
      absl::StrCat("over ", settings_.size.most_events, " events fall into one block of ",
                   settings_.size.block_frame_count, " frames; report fewer points"));
}

/// Returns the longest time, in frames, by which a known contact begins before its impulse.
uint64_t ForwardRenderer::AheadFrames() const {
  return static_cast<uint64_t>(
             std::ceil(target_.longest_contact_s * mixer_.settings().sample_rate_hz)) +
         1;
}

/// Returns the number of blocks to render together, so that the queue holds the events of all these
/// blocks.
size_t ForwardRenderer::CountBlocks(size_t most) const {
  const uint64_t first = mixer_.frame() + AheadFrames();
  size_t count = std::min(most, kBlocksTogether);
  const size_t half = settings_.size.most_events / 2;
  while (count > 1 && target_.events.size() > half &&
         target_.events[half].FirstSample() < first + count * settings_.size.block_frame_count) {
    --count;
  }
  return count;
}

/// Pushes the events before `frame`. Then pushes the events whose contacts may begin before
/// `frame`, until the mixer's queue is full.
void ForwardRenderer::PushEventsBefore(uint64_t frame) {
  for (const uint64_t end = frame + AheadFrames(); target_.events.size() > 0;
       target_.events.Pop()) {
    const MixerEvent& event = target_.events[0];
    if (event.FirstSample() >= end) return;
    if (stream_->TryPush(event)) continue;
    if (event.FirstSample() >= frame) return;
    intake_.Reject(event.ReportCount(), TooManyEvents());
  }
}

}  // namespace carillon
