// SPDX-License-Identifier: Apache-2.0
#include "server/scene/offline/environment.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

/// The shortest blocks into which a step is divided.
constexpr size_t kShortBlock = 16;
/// Returns the largest divisor of a number of frames that suits a block, or zero. The longer the
/// blocks, the less often the fixed cost of a block comes up.
size_t BlockThatDivides(size_t frame_count) {
  for (size_t block = kMostBlockFrames; block >= kShortBlock; --block) {
    if (frame_count % block == 0) return block;
  }
  return 0;
}

}  // namespace

StepTiming TimingOf(const EnvironmentSettings& settings) {
  const double step_frames = settings.step_s * settings.sample_rate_hz;
  const auto asked =
      static_cast<uint64_t>(std::llround(settings.latency_s * settings.sample_rate_hz));
  const bool whole = std::abs(step_frames - std::round(step_frames)) < 1e-6;
  // A step that is no whole number of frames may end a frame before its samples do.
  const size_t slack = whole ? 0 : 1;
  if (asked >= kOfflineBlockFrames - 1 + slack) return {kOfflineBlockFrames, asked};
  if (whole) {
    if (const size_t block = BlockThatDivides(static_cast<size_t>(std::llround(step_frames)))) {
      return {block, asked};
    }
  }
  return {kShortBlock, std::max<uint64_t>(asked, kShortBlock - 1 + slack)};
}

absl::StatusOr<std::unique_ptr<ForwardRenderer>> Environment::MakeRenderer(
    const Microphone& microphone) {
  const bool by_distance = settings_.hearing.distance_gain;
  return ForwardRenderer::Make(
      {.sample_rate_hz = settings_.sample_rate_hz,
       .channel_count = static_cast<uint32_t>(ChannelCountOf(microphone)),
       // Levels become those at 1 m, whatever the reference distance.
       .gain = by_distance ? 1 / settings_.hearing.reference_distance_m : 1,
       .full_scale_pa = settings_.full_scale_pa,
       .step_s = settings_.step_s,
       .space = SpaceOf(microphone, settings_.hearing, settings_.head),
       .reading = settings_.reading,
       .mapping = {.delay_s =
                       static_cast<double>(timing_.latency_frames) / settings_.sample_rate_hz},
       .tells_blows = settings_.tells_impacts && heard_.empty(),
       .balances = balances_ && heard_.empty(),
       .thread_count = 1,
       .size = {.block_frame_count = timing_.block_frame_count,
                .most_objects = settings_.most_objects,
                .most_events = settings_.most_events()},
       .is_observation = true},
      bodies_, transfers_);
}

absl::Status Environment::Reset() {
  if (!heard_.empty()) rejected_before_ = rejected_count();
  heard_.clear();
  step_count_ = 0;
  for (const Microphone& microphone : settings_.microphones) {
    ASSIGN_OR_RETURN(auto renderer, MakeRenderer(microphone));
    for (const auto& [handle, object] : objects_) {
      RETURN_IF_ERROR(
          renderer->AddObject(handle, object.model, object.properties, &object.transfer));
    }
    heard_.push_back({.renderer = std::move(renderer)});
  }
  return absl::OkStatus();
}

absl::Status Environment::AddObject(uint32_t handle, std::shared_ptr<const ModalModel> model,
                                    const ObjectProperties& properties) {
  std::shared_ptr<const Transfer> transfer;
  for (const Heard& heard : heard_) {
    const bool is_first = &heard == &heard_.front();
    RETURN_IF_ERROR(
        heard.renderer->AddObject(handle, model, properties, is_first ? nullptr : &transfer));
    if (is_first) transfer = heard.renderer->TransferOf(handle);
  }
  objects_[handle] = {std::move(model), properties, std::move(transfer)};
  return absl::OkStatus();
}

absl::Status Environment::RemoveObject(uint32_t handle) {
  for (const Heard& heard : heard_) RETURN_IF_ERROR(heard.renderer->RemoveObject(handle));
  objects_.erase(handle);
  return absl::OkStatus();
}

void Environment::Step(double time_scale, absl::FunctionRef<void(size_t, ContactIntake&)> read,
                       RenderWorkspace& workspace, size_t frame_count, std::span<float> samples) {
  if (time_scale > 0) ++step_count_;
  const double time_s = static_cast<double>(step_count_) * settings_.step_s;
  for (size_t microphone = 0; microphone < heard_.size(); ++microphone) {
    Heard& heard = heard_[microphone];
    ContactIntake& intake = heard.renderer->intake();
    // Times ascend and the scale has been checked, so that no error is possible.
    [[maybe_unused]] const absl::Status begun = intake.BeginStep(time_s, time_scale);
    read(microphone, intake);
    Follow(settings_.microphones[microphone], heard);
    intake.EndStep();
    const size_t channel_count = heard.renderer->settings().channel_count;
    if (channel_count == 1 && heard.frames.empty() &&
        frame_count % timing_.block_frame_count == 0) {
      heard.renderer->Render(samples.first(frame_count), &workspace);
      samples = samples.subspan(frame_count);
      continue;
    }
    Render(frame_count, workspace, heard);
    for (size_t channel = 0; channel < channel_count; ++channel) {
      const float* from = heard.frames.data() + channel;
      for (float& sample : samples.first(frame_count)) {
        sample = *from;
        from += channel_count;
      }
      samples = samples.subspan(frame_count);
    }
    heard.frames.erase(heard.frames.begin(),
                       heard.frames.begin() + static_cast<ptrdiff_t>(frame_count * channel_count));
  }
}

/// Moves a microphone with the object that carries it.
void Environment::Follow(const Microphone& microphone, Heard& heard) {
  if (!microphone.object) return;
  const std::optional<Pose> carrier = heard.renderer->PoseOf(*microphone.object);
  if (!carrier || carrier == heard.carrier) return;
  heard.carrier = carrier;
  heard.renderer->intake().MoveListener(Composed(*carrier, microphone.pose));
}

/// Renders whole blocks until there are enough frames.
void Environment::Render(size_t frame_count, RenderWorkspace& workspace, Heard& heard) const {
  const size_t channel_count = heard.renderer->settings().channel_count;
  const size_t there = heard.frames.size() / channel_count;
  if (there >= frame_count) return;
  const size_t block = timing_.block_frame_count;
  const size_t block_count = (frame_count - there + block - 1) / block;
  heard.frames.resize((there + block_count * block) * channel_count);
  heard.renderer->Render(std::span(heard.frames).subspan(there * channel_count), &workspace);
}

std::vector<BlowRecord> Environment::TakeImpacts() {
  std::vector<BlowRecord> impacts = first().TakeBlows();
  const double latency_s = first().settings().mapping.delay_s;
  for (BlowRecord& impact : impacts) impact.time_s -= latency_s;
  return impacts;
}

size_t Environment::object_bytes() const {
  size_t bytes = 0;
  for (const Heard& heard : heard_) bytes += heard.renderer->object_bytes();
  return bytes;
}

uint64_t Environment::rejected_count() const {
  return rejected_before_ + first().intake().rejected_count();
}

}  // namespace carillon
