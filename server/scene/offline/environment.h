// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "server/scene/offline/forward_renderer.h"
#include "server/scene/offline/microphone.h"

namespace carillon {

/// What all environments of a performance have in common.
struct EnvironmentSettings {
  uint32_t sample_rate_hz = 48000;
  double step_s = 1.0 / 60;
  double latency_s = 0;  ///< time from a contact to its sound, 0 to 0.1
  double full_scale_pa = 1;
  std::vector<Microphone> microphones{};
  HearingSettings hearing{};
  std::shared_ptr<const Head> head = nullptr;  ///< of microphones of the kind kEars
  ContactReading reading{};
  bool tells_impacts = false;
  size_t most_objects = 128;  ///< in an environment, with those that fade out

  /// Most events that fall into the blocks rendered together, and therefore of a step.
  size_t most_events() const { return 8 * most_objects; }
};

/// How steps are divided into blocks of the mixer. If the latency allows it, blocks are those of
/// offline renderings, and frames are rendered up to a block ahead of the step. For a shorter
/// latency the step is divided into equal blocks. If that cannot be done, blocks are short, and the
/// latency is at least theirs.
struct StepTiming {
  size_t block_frame_count = 0;
  uint64_t latency_frames = 0;
};
StepTiming TimingOf(const EnvironmentSettings& settings);

/// One of several simulations that are performed in step, with its objects and microphones. Each
/// microphone hears its own rendering. Only one thread at a time may use an object.
class Environment {
 public:
  /// `bodies` and `transfers` must outlive this. `balances` is as of IntakeSettings. Reset must be
  /// called first.
  Environment(const EnvironmentSettings& settings, BodyCache& bodies, TransferStore* transfers,
              bool balances)
      : settings_(settings),
        timing_(TimingOf(settings)),
        bodies_(bodies),
        transfers_(transfers),
        balances_(balances) {}

  /// Ends all sound at once, and begins anew with the objects as they were added: a transfer that
  /// has been stored since then changes nothing. Errors: those of
  /// ForwardRenderer::Make.
  absl::Status Reset();

  /// Errors: those of ForwardRenderer::AddObject.
  absl::Status AddObject(uint32_t handle, std::shared_ptr<const ModalModel> model,
                         const ObjectProperties& properties);

  /// Removes an object, whose sound fades out. Errors: NotFound (OBJECT_NOT_FOUND).
  absl::Status RemoveObject(uint32_t handle);

  /// Performs a step at a scale of time (ContactIntake::BeginStep). `read` gives its poses and
  /// contacts to the intake of each microphone. Writes `frame_count` frames of each channel to
  /// `samples`, one channel after the other.
  void Step(double time_scale, absl::FunctionRef<void(size_t microphone, ContactIntake&)> read,
            RenderWorkspace& workspace, size_t frame_count, std::span<float> samples);

  /// Returns the impacts that have been found since the last call. Their times do not include the
  /// latency.
  std::vector<BlowRecord> TakeImpacts();

  /// Returns the memory that the objects take, bytes.
  size_t object_bytes() const;

  /// Number of rejected contacts and poses since the first step, resets included.
  uint64_t rejected_count() const;
  absl::Status last_rejection() const { return first().intake().last_rejection(); }

  /// Number of objects that sound by the paper's coupling because no transfer fits their material.
  uint32_t paper_coupling_object_count() const { return first().paper_coupling_object_count(); }

  /// What is unusual about the contacts since the last reset, and the number of impulses taken.
  IntakeFindings findings() const { return first().intake().findings(); }
  uint64_t accepted_count() const { return first().statistics().accepted_count; }

 private:
  struct AddedObject {
    std::shared_ptr<const ModalModel> model;
    ObjectProperties properties;
    std::shared_ptr<const Transfer> transfer;  // that the object had first, null for none
  };
  /// What one microphone hears.
  struct Heard {
    std::unique_ptr<ForwardRenderer> renderer;
    std::optional<Pose> carrier = std::nullopt;  // the newest pose of the object that carries it
    std::vector<float> frames{};                 // rendered, but not given out yet, interleaved
  };

  ForwardRenderer& first() const { return *heard_.front().renderer; }
  absl::StatusOr<std::unique_ptr<ForwardRenderer>> MakeRenderer(const Microphone& microphone);
  void Follow(const Microphone& microphone, Heard& heard);
  void Render(size_t frame_count, RenderWorkspace& workspace, Heard& heard) const;

  const EnvironmentSettings& settings_;
  const StepTiming timing_;
  BodyCache& bodies_;
  TransferStore* const transfers_;
  const bool balances_;
  std::map<uint32_t, AddedObject> objects_;
  std::vector<Heard> heard_;      // of each microphone
  uint64_t step_count_ = 0;       // since the last reset, without pauses
  uint64_t rejected_before_ = 0;  // before the last reset
};

}  // namespace carillon
