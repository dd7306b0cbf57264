// SPDX-License-Identifier: Apache-2.0
#include "server/scene/offline/performance.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

constexpr double kLongestStepS = 1;

/// Returns the length of the sound of a step over the step.
double SoundSteps(double time_scale) { return time_scale > 0 ? 1 / time_scale : 1; }

absl::Status Invalid(absl::string_view what, double value, double least, double most) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                 absl::StrCat(what, " is ", value, "; it must be ", least, " to ", most));
}

size_t CountChannels(const EnvironmentSettings& settings) {
  return std::transform_reduce(settings.microphones.begin(), settings.microphones.end(), size_t{0},
                               std::plus<>(), ChannelCountOf);
}

}  // namespace

absl::Status Performance::Validate(const EnvironmentSettings& settings, size_t environment_count) {
  if (environment_count < 1 || environment_count > kMostEnvironments) {
    return Invalid("environment_count", static_cast<double>(environment_count), 1,
                   kMostEnvironments);
  }
  if (settings.microphones.empty() || settings.microphones.size() > kMostMicrophones) {
    return Invalid("the number of microphones", static_cast<double>(settings.microphones.size()), 1,
                   kMostMicrophones);
  }
  if (!(settings.latency_s >= 0 && settings.latency_s <= 0.1)) {
    return Invalid("latency_s", settings.latency_s, 0, 0.1);
  }
  if (!(settings.step_s >= 1e-6 && settings.step_s <= kLongestStepS)) {
    return Invalid("step_s", settings.step_s, 1e-6, kLongestStepS);
  }
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<Performance>> Performance::Make(const EnvironmentSettings& settings,
                                                               size_t environment_count,
                                                               size_t thread_count,
                                                               BodyCache& bodies,
                                                               TransferStore* transfers) {
  RETURN_IF_ERROR(Validate(settings, environment_count));
  thread_count = std::min(thread_count, environment_count);
  std::unique_ptr<Performance> performance(new Performance(settings, thread_count));
  for (size_t i = 0; i < environment_count; ++i) {
    // All environments have the same engine, whose mistakes the first one shows.
    auto environment =
        std::make_unique<Environment>(performance->settings_, bodies, transfers, i == 0);
    RETURN_IF_ERROR(environment->Reset());
    performance->environments_.push_back(std::move(environment));
  }
  return performance;
}

Performance::Performance(const EnvironmentSettings& settings, size_t thread_count)
    : settings_(settings),
      channel_count_(CountChannels(settings)),
      latency_frames_(TimingOf(settings).latency_frames),
      threads_(thread_count) {
  for (size_t i = 0; i < threads_.size(); ++i) {
    workspaces_.emplace_back(TimingOf(settings).block_frame_count);
  }
}

size_t Performance::EnvironmentBytes(const EnvironmentSettings& settings) {
  constexpr size_t kEventBytes = 800;
  return settings.microphones.size() * settings.most_events() * kEventBytes;
}

absl::Status Performance::CheckScale(double time_scale) const {
  RETURN_IF_ERROR(CheckTimeScale(time_scale, step_count_));
  const double sound_s = SoundSteps(time_scale) * settings_.step_s;
  if (sound_s <= kLongestStepS) return absl::OkStatus();
  return Refusal(
      absl::StatusCode::kInvalidArgument, "INVALID_STREAM",
      absl::StrCat("the sound of step ", step_count_, " lasts ", sound_s, " s at a time_scale of ",
                   time_scale, "; it may last 1 s: perform shorter steps"));
}

std::span<const float> Performance::Step(Read read, double time_scale) {
  const double before = sound_steps_;
  sound_steps_ += SoundSteps(time_scale);
  const auto frames_until = [&](double count) {
    return std::round(count * settings_.step_s * settings_.sample_rate_hz);
  };
  frame_count_ = static_cast<size_t>(frames_until(sound_steps_) - frames_until(before));
  ++step_count_;
  const size_t size = channel_count_ * frame_count_;
  samples_.resize(environments_.size() * size);
  const auto perform = [&](size_t thread, size_t index) {
    environments_[index]->Step(
        time_scale,
        [&](size_t microphone, ContactIntake& intake) { read(index, microphone, intake); },
        workspaces_[thread], frame_count_, std::span(samples_).subspan(index * size, size));
  };
  threads_.Render(environments_.size(), perform);
  return samples_;
}

}  // namespace carillon
