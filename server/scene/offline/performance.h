// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/scene/offline/environment.h"
#include "server/scene/offline/microphone.h"
#include "server/synthesis/bank/block_mix.h"
#include "server/synthesis/render_threads.h"

namespace carillon {

/// Renders environments that are simulated in step: a step goes in, and the samples of that step
/// come out.
///
///     frames of step k = round(k step rate) - round((k - 1) step rate)
///
/// There is no clock but the steps. The samples of an environment are the same bit for bit whatever
/// the number of environments and of threads. Only one thread at a time may use an object.
class Performance {
 public:
  static constexpr size_t kMostEnvironments = 4096;
  static constexpr size_t kMostMicrophones = 16;

  /// `bodies` and `transfers` must outlive the performance. Errors: InvalidArgument
  /// (INVALID_SETTINGS, and those of ForwardRenderer::Make).
  static absl::StatusOr<std::unique_ptr<Performance>> Make(const EnvironmentSettings& settings,
                                                           size_t environment_count,
                                                           size_t thread_count, BodyCache& bodies,
                                                           TransferStore* transfers = nullptr);

  /// Checks the number of environments, and the settings that are not ForwardRenderer's. Errors:
  /// InvalidArgument (INVALID_SETTINGS).
  static absl::Status Validate(const EnvironmentSettings& settings, size_t environment_count);

  const EnvironmentSettings& settings() const { return settings_; }
  size_t environment_count() const { return environments_.size(); }
  Environment& environment(size_t index) { return *environments_[index]; }

  /// Frames from a contact to its sound.
  uint64_t latency_frames() const { return latency_frames_; }
  size_t channel_count() const { return channel_count_; }

  /// Returns the memory of one environment without its objects, bytes.
  static size_t EnvironmentBytes(const EnvironmentSettings& settings);

  /// Performs a step, whose sound lasts the step over `time_scale` or, in a pause, at zero, the
  /// step. `read` gives the poses and contacts of an environment to the intake of one of
  /// its microphones; several threads call it at once. Returns the samples, which stay valid until
  /// the next call: element [environment][channel][frame].
  using Read = absl::FunctionRef<void(size_t environment, size_t microphone, ContactIntake&)>;
  std::span<const float> Step(Read read, double time_scale = 1);

  /// Checks the scale of the next step. Errors: InvalidArgument (INVALID_STREAM: the scale is not
  /// 0.001 to 1000, or the sound of the step is longer than 1 s).
  absl::Status CheckScale(double time_scale) const;

  /// Number of frames of the last step.
  size_t frame_count() const { return frame_count_; }

 private:
  Performance(const EnvironmentSettings& settings, size_t thread_count);

  const EnvironmentSettings settings_;
  const size_t channel_count_;
  const uint64_t latency_frames_;
  RenderThreads threads_;
  std::vector<RenderWorkspace> workspaces_;  // one for each thread
  std::vector<std::unique_ptr<Environment>> environments_;
  std::vector<float> samples_;
  uint64_t step_count_ = 0;
  double sound_steps_ = 0;  // the length of the sound over the step
  size_t frame_count_ = 0;
};

}  // namespace carillon
