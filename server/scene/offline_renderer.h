// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/scene/contact_stream.h"
#include "server/scene/frame_time.h"
#include "server/scene/sounding_body.h"
#include "server/scene/sounding_object.h"
#include "server/synthesis/mixer.h"
#include "server/synthesis/render_threads.h"

namespace carillon {

/// How to render offline.
struct OfflineSettings {
  uint32_t sample_rate_hz = 48000;
  uint32_t channel_count = 1;  ///< or 2
  /// How long to go on after the last contact; zero: until all is below -80 dB of full scale, at
  /// most 60 s.
  double tail_s = 0;
  /// The simulator's step, seconds, above 0 and at most 1.
  double step_s = 1.0 / 60;
  SceneSpace space{};
  /// As the trace was heard live: the rendering begins at its first frame, a multiple of
  /// OfflineRenderer::kBlockFrameCount.
  TimeMapping mapping{};
  /// The sound does not depend on it, not by a bit.
  size_t thread_count = std::max(std::thread::hardware_concurrency(), 1U);
};

/// What has been rendered.
struct OfflineSummary {
  uint64_t frame_count = 0;
  uint64_t accepted_count = 0;
  uint64_t rejected_count = 0;
  double peak = 0;  ///< before the limiter
  uint64_t limited_frame_count = 0;
};

/// Renders a recorded simulation on a virtual clock with a mixer of its own, as fast as it can and
/// bit for bit the same each time: frame 0 is simulation time zero, unless the settings map time
/// otherwise, and nothing comes late. Objects
/// first, then the impulses, then Render until it is done. One thread at a time.
class OfflineRenderer {
 public:
  /// Frames that Render makes at a time.
  static constexpr size_t kBlockFrameCount = 128;
  /// Impulses later than this are rejected.
  static constexpr double kMaxTimeS = 86400;

  /// `bodies` must outlive the renderer. Errors: InvalidArgument (INVALID_SETTINGS,
  /// INVALID_HEARING, INVALID_POSE).
  static absl::StatusOr<std::unique_ptr<OfflineRenderer>> Make(const OfflineSettings& settings,
                                                               BodyCache& bodies);

  /// Errors: AlreadyExists (OBJECT_EXISTS), and those of MakeSoundingObject.
  absl::Status AddObject(uint32_t handle, std::shared_ptr<const ModalModel> model,
                         const ObjectProperties& properties);

  /// Begins the step at simulation time `time_s`, which does not go back.
  void BeginStep(double time_s);

  /// An impulse of that step, a force that lasts, and a contact that may be a blow or a load. Where
  /// it cannot be used it is counted as rejected.
  void Strike(const ObjectImpulse& impulse);
  void Hold(const ObjectForce& force);
  void Touch(const ObjectTouch& touch);

  /// Where an object is at that step's time, and where the listener is. Rejected likewise.
  void Move(uint32_t handle, const Pose& pose);
  void MoveListener(const Pose& pose);

  /// Ends the step: its forces are all known.
  void EndStep();

  /// Counts `count` impulses that could not be used.
  void Reject(uint64_t count) { summary_.rejected_count += count; }

  /// Renders the next frames, interleaved, as many as `samples` holds, a multiple of
  /// kBlockFrameCount; returns how many, zero after the end.
  size_t Render(std::span<float> samples);

  /// True for everything rendered so far.
  const OfflineSummary& summary() const { return summary_; }

 private:
  OfflineRenderer(const OfflineSettings& settings, BodyCache& bodies);

  absl::Status TryStrike(const ObjectImpulse& impulse);
  absl::StatusOr<FeltContact> Locate(uint32_t handle, const ContactImpulse& contact,
                                     const std::optional<SecondObject>& second) const;
  void Push(BankId bank, const MixerEvent::Action& action, double time_s);
  void PushForce(uint32_t handle, const MixerEvent::Action& action, double time_s);
  void PushEventsBefore(uint64_t frame);
  size_t RenderBlocks(std::span<float> samples);
  size_t CountBlocks(size_t most) const;
  uint64_t EndFrame() const;
  bool TailEnded(std::span<const float> block);
  double QuietS() const;

  const OfflineSettings settings_;
  BodyCache& bodies_;
  RenderThreads threads_;
  Mixer mixer_;
  std::unique_ptr<EventStream> stream_;
  std::map<uint32_t, SoundingObject> objects_;
  std::vector<MixerEvent> events_;  // in order of time once rendering has begun
  ContactForces forces_;
  PoseTimes pose_times_;
  double step_time_s_ = 0;
  size_t pushed_count_ = 0;
  size_t contact_count_ = 0;  // events up to the last that is no move
  uint64_t quiet_frame_count_ = 0;
  bool begun_ = false;
  bool ended_ = false;
  OfflineSummary summary_;
};

}  // namespace carillon
