// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/scene/contact_intake.h"
#include "server/scene/due_frame.h"
#include "server/scene/scene.h"
#include "server/scene/sounding_body.h"
#include "server/scene/sounding_object.h"
#include "server/synthesis/bank/level.h"
#include "server/synthesis/mixer.h"
#include "server/synthesis/render_threads.h"

namespace carillon {

/// Settings of an offline rendering.
struct OfflineSettings {
  uint32_t sample_rate_hz = 48000;
  uint32_t channel_count = 1;  ///< 1 or 2
  /// Length of the sound after the last contact. If it is zero, the sound ends when it stays below
  /// -80 dB of full scale, and after 60 s at the latest.
  double tail_s = 0;
  double gain = 1;                      ///< gain of the whole sound, before the limiter
  double full_scale_pa = kFullScalePa;  ///< the pressure of a sample of 1
  /// The simulator's step, seconds, above 0 and at most 1.
  double step_s = 1.0 / 60;
  SceneSpace space{};
  ContactReading reading{};
  /// The mapping by which the trace was heard live. Rendering begins at its first frame, a multiple
  /// of OfflineRenderer::kBlockFrameCount.
  TimeMapping mapping{};
  /// The stagger of the bus through which the trace was heard live (Mixer::Stagger).
  size_t stagger = 0;
  bool tells_blows = false;  ///< whether OfflineRenderer::blows() is filled in
  /// The sound is bit for bit the same for any number of threads.
  size_t thread_count = std::max(std::thread::hardware_concurrency(), 1U);
};

/// The result of an offline rendering.
struct OfflineSummary {
  uint64_t frame_count = 0;
  uint64_t accepted_count = 0;
  uint64_t rejected_count = 0;
  absl::Status last_rejection;  ///< reason of the newest rejection; OK if none
  double peak = 0;              ///< largest sample before the limiter
  uint64_t limited_frame_count = 0;
  IntakeFindings findings;
  /// Objects that sound by the paper's coupling because no transfer fits their material.
  uint32_t paper_coupling_object_count = 0;
};

/// Renders a recorded simulation with a mixer of its own, as fast as possible and bit for bit the
/// same each time. Time is virtual: no contact is late, and frame 0 is simulation time zero unless
/// the settings map time otherwise. A caller first adds objects, then gives all steps to the
/// intake, then calls Render until it returns zero. Only one thread at a time may use an object.
class OfflineRenderer {
 public:
  /// Number of frames in a block that Render makes.
  static constexpr size_t kBlockFrameCount = kOfflineBlockFrames;
  /// Impulses later than this after the first time of the mapping, seconds, are rejected.
  static constexpr double kMaxDurationS = 86400;

  /// `bodies` and `transfers` must outlive the renderer. `transfers` is null if none are stored.
  /// Errors: InvalidArgument (INVALID_SETTINGS, INVALID_POSE).
  static absl::StatusOr<std::unique_ptr<OfflineRenderer>> Make(const OfflineSettings& settings,
                                                               BodyCache& bodies,
                                                               TransferStore* transfers = nullptr);

  /// Adds an object. Errors: AlreadyExists (OBJECT_EXISTS), and those of MakeSoundingObject.
  absl::Status AddObject(uint32_t handle, std::shared_ptr<const ModalModel> model,
                         const ObjectProperties& properties);

  /// The intake that takes the steps of the simulation.
  ContactIntake& intake() { return intake_; }

  /// Returns the memory that the objects and the steps take so far, bytes. Models are shared with
  /// others and not counted.
  size_t held_bytes() const;

  /// Renders whole blocks of kBlockFrameCount frames into `samples`, channels interleaved, until no
  /// further block fits or the sound ends. `samples` must hold at least one block. Returns the
  /// number of frames that belong to the sound, which is zero after its end.
  size_t Render(std::span<float> samples);

  /// The impulses in the frames rendered so far, if the settings ask for them.
  const std::vector<BlowRecord>& blows() const { return blows_; }

  /// The result of all frames rendered so far.
  const OfflineSummary& summary() const { return summary_; }

 private:
  /// Keeps the events until they are rendered.
  class Target final : public EventTarget {
   public:
    explicit Target(uint64_t first_frame) : first_frame_(first_frame) {}
    uint64_t frame() const override { return first_frame_; }
    void Push(const MixerEvent& event) override { events.push_back(event); }

    // Sorted by time once rendering has begun. A deque, unlike a vector, never holds two copies of
    // the events while it grows.
    std::deque<MixerEvent> events;

   private:
    const uint64_t first_frame_;
  };

  OfflineRenderer(const OfflineSettings& settings, BodyCache& bodies, TransferStore* transfers);

  std::deque<MixerEvent>& events() { return target_.events; }
  const std::deque<MixerEvent>& events() const { return target_.events; }
  void PushEventsBefore(uint64_t frame);
  size_t RenderBlocks(std::span<float> samples);
  size_t CountBlocks(size_t most) const;
  uint64_t EndFrame() const;
  bool TailEnded(std::span<const float> block);
  double QuietS() const;

  const OfflineSettings settings_;
  BodyCache& bodies_;
  TransferStore* transfers_;
  RenderThreads threads_;
  Mixer mixer_;
  std::unique_ptr<EventStream> stream_;
  Scene scene_;
  Target target_;
  std::vector<BlowRecord> blows_;
  ContactIntake intake_;
  size_t pushed_count_ = 0;
  size_t object_bytes_ = 0;
  size_t contact_count_ = 0;  // number of events up to the last that is not a move
  uint64_t ahead_frame_count_ = 0;
  uint64_t quiet_frame_count_ = 0;
  bool begun_ = false;
  bool ended_ = false;
  OfflineSummary summary_;
};

}  // namespace carillon
