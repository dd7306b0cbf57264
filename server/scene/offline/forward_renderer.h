// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/scene/contact_intake.h"
#include "server/scene/offline/waiting_events.h"
#include "server/scene/scene.h"
#include "server/scene/sounding_body.h"
#include "server/scene/sounding_object.h"
#include "server/scene/time_mapping.h"
#include "server/synthesis/bank/level.h"
#include "server/synthesis/mixer.h"
#include "server/synthesis/render_threads.h"

namespace carillon {

/// Settings of an offline rendering.
struct OfflineSettings {
  uint32_t sample_rate_hz = 48000;
  uint32_t channel_count = 1;  ///< 1 or 2; in ambisonics up to 16
  /// Length of the sound after the last contact. If it is zero, the sound ends when it stays below
  /// -80 dB of full scale and 60 dB below its peak, and after 60 s at the latest. Only
  /// OfflineRenderer uses it.
  double tail_s = 0;
  /// The tail ends at this time from the first frame at the latest, seconds; zero for no such time.
  /// Only OfflineRenderer uses it.
  double longest_s = 0;
  double gain = 1;                      ///< gain of the whole sound, before the limiter
  double full_scale_pa = kFullScalePa;  ///< the pressure of a sample of 1
  /// The simulator's step, seconds, above 0 and at most 1.
  double step_s = 1.0 / 60;
  SceneSpace space{};
  ContactReading reading{};
  /// The mapping by which the trace was heard live. Rendering begins at its first frame, a multiple
  /// of kOfflineBlockFrames.
  TimeMapping mapping{};
  /// The stagger of the bus through which the trace was heard live (Mixer::Stagger).
  size_t stagger = 0;
  bool tells_blows = false;  ///< whether TakeBlows has anything to give
  bool balances = true;      ///< as of IntakeSettings
  /// The sound is bit for bit the same for any number of threads.
  size_t thread_count = std::max(std::thread::hardware_concurrency(), 1U);
  /// Sizes for which memory is taken.
  struct Size {
    size_t block_frame_count = kOfflineBlockFrames;
    size_t most_objects = 4096;  ///< also those that fade out
    size_t most_events = 65536;  ///< in a block
  } size{};
  /// Whether no limiter works, and each call of Render is given a workspace.
  bool is_observation = false;
};

/// Renders a simulation offline while its steps come in, with a mixer of its own, as fast as
/// possible and bit for bit the same each time. Time is virtual: frame 0 is simulation time zero
/// unless the settings map time otherwise. A caller adds objects and gives steps to the intake, and
/// renders as far as it likes:
///
///     first frame ...... frame() ............ settled_frame() ......... the newest step
///     rendered           can no longer change  contacts that come later may still lie here
///
/// Memory is taken for the objects and for the events from frame() on, whatever the length of the
/// simulation. Only one thread at a time may use an object.
class ForwardRenderer {
 public:
  /// Impulses later than this after the first time of the mapping, seconds, are rejected.
  static constexpr double kMaxDurationS = 86400;

  /// `bodies` and `transfers` must outlive the renderer. `transfers` is null if none are stored.
  /// Errors: InvalidArgument (INVALID_SETTINGS, INVALID_POSE).
  static absl::StatusOr<std::unique_ptr<ForwardRenderer>> Make(const OfflineSettings& settings,
                                                               BodyCache& bodies,
                                                               TransferStore* transfers = nullptr);

  /// Adds an object, with the transfer to which `chosen` points or, if it is null, with the one
  /// that is stored. Errors: AlreadyExists (OBJECT_EXISTS), and those of MakeSoundingObject.
  absl::Status AddObject(uint32_t handle, std::shared_ptr<const ModalModel> model,
                         const ObjectProperties& properties,
                         const std::shared_ptr<const Transfer>* chosen = nullptr);

  /// Removes an object. Its sound fades out within 10 ms, and what is on its way to it is lost.
  /// Errors: NotFound (OBJECT_NOT_FOUND).
  absl::Status RemoveObject(uint32_t handle);

  /// Returns the transfer of an object, or null if there is none.
  std::shared_ptr<const Transfer> TransferOf(uint32_t handle) const;

  /// Returns the newest pose of an object, or nothing if there is no such object, or it has none.
  std::optional<Pose> PoseOf(uint32_t handle) const;

  /// The intake that takes the steps of the simulation.
  ContactIntake& intake() { return intake_; }

  /// Ends the simulation: no further step comes.
  void Finish();
  bool finished() const { return finished_; }

  /// Returns the number of the first frame that a step which has not come yet can change. After
  /// Finish there is no such frame, and the result is the largest number.
  uint64_t settled_frame() const;

  /// Number of the next frame to be rendered.
  uint64_t frame() const { return mixer_.frame(); }

  /// Renders the next frames into `samples`, whole blocks of the size of the settings, channels
  /// interleaved. What comes later than that changes nothing: a contact that is due in these frames
  /// and comes after this call sounds in the first frame after them. Several renderers may use one
  /// `workspace`, one after the other.
  void Render(std::span<float> samples, RenderWorkspace* workspace = nullptr);

  /// Number of the latest frame in which a contact that has come so far is due.
  uint64_t last_contact_frame() const { return target_.last_contact_frame; }

  /// Returns the memory that the objects take, bytes. Models are shared with others and not
  /// counted.
  size_t object_bytes() const { return object_bytes_; }

  /// Returns the memory that the events which wait take, bytes.
  size_t waiting_bytes() const { return target_.events.size() * sizeof(MixerEvent); }

  /// Returns the impulses that have been found since the last call, if the settings ask for them.
  std::vector<BlowRecord> TakeBlows() { return std::exchange(blows_, {}); }

  /// Number of objects that sound by the paper's coupling because no transfer fits their material.
  uint32_t paper_coupling_object_count() const { return paper_coupling_object_count_; }

  /// The largest sample before the limiter since the last call.
  double TakePeak() { return mixer_.TakePeak(); }

  MixerStatistics statistics() const { return mixer_.statistics(); }
  const OfflineSettings& settings() const { return settings_; }

 private:
  /// Keeps the events until they are rendered.
  struct Target final : EventTarget {
    explicit Target(uint64_t first) : next_frame(first), last_contact_frame(first) {}
    uint64_t frame() const override { return next_frame; }
    void Push(const MixerEvent& event) override;

    uint64_t next_frame;
    WaitingEvents events{};
    uint64_t last_contact_frame;
    double longest_contact_s = 0;
  };

  ForwardRenderer(const OfflineSettings& settings, BodyCache& bodies, TransferStore* transfers);

  uint64_t AheadFrames() const;
  size_t CountBlocks(size_t most) const;
  void PushEventsBefore(uint64_t frame);
  void RejectDropped();
  absl::Status TooManyEvents() const;

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
  size_t object_bytes_ = 0;
  uint32_t paper_coupling_object_count_ = 0;
  uint64_t dropped_count_ = 0;
  bool removed_ = false;
  bool finished_ = false;
};

}  // namespace carillon
