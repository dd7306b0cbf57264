// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "absl/status/statusor.h"
#include "server/scene/contact_intake.h"
#include "server/scene/scene.h"
#include "server/synthesis/mixer.h"

namespace carillon {

/// Returns whether a simulator may have steps of this length, 1e-6 to 1 s.
inline bool IsStepLength(double step_s) { return step_s >= 1e-6 && step_s <= 1; }

/// Settings by which a contact stream maps simulation time to audio time.
struct ContactStreamSettings {
  double step_s = 0;  ///< the simulator's step, from 1e-6 to 1
  /// 0 to 10. If it is absent, the delay is one step, one block and 5 ms for the network.
  std::optional<double> scheduling_delay_s = std::nullopt;
  /// Whether each contact sounds at its arrival, delayed only by its own time offset.
  bool at_once = false;
  ContactReading reading{};
  RejectionCounts* rejections = nullptr;  ///< see IntakeSettings
};

/// The numbers of a stream's steps, and of its impulses by outcome.
struct ContactCounts {
  uint64_t step_count = 0;
  uint64_t accepted_count = 0;
  uint64_t late_count = 0;
  uint64_t dropped_count = 0;
  uint64_t rejected_count = 0;
  uint64_t remap_count = 0;  ///< times that simulation time was mapped anew
};

/// The contacts of one running simulator. The events of the stream's intake go through a queue to
/// the live mixer. Only one thread at a time may use an object.
class ContactStream {
 public:
  /// `mixer` must outlive the stream. Errors: InvalidArgument (INVALID_STREAM), ResourceExhausted
  /// (TOO_MANY_STREAMS).
  static absl::StatusOr<std::unique_ptr<ContactStream>> Make(std::shared_ptr<Scene> scene,
                                                             Mixer& mixer,
                                                             const ContactStreamSettings& settings);

  IntakeFindings findings() const { return intake_.findings(); }

  /// Takes the reports of the simulator.
  ContactIntake& intake() { return intake_; }

  double scheduling_delay_s() const { return intake_.mapping().delay_s; }

  /// Returns the mixer's frame to which the first step's time is mapped, less the scheduling delay,
  /// or nothing before the first step.
  std::optional<uint64_t> first_frame() const {
    return intake_.step_count() > 0 ? std::optional(intake_.mapping().first_frame) : std::nullopt;
  }

  /// Returns the time from the mixer's frame to the newest step's, seconds.
  double ahead_s() const { return intake_.ahead_s(); }

  /// Returns the counts. No count includes impulses that the mixer has not taken yet.
  ContactCounts counts() const;

  /// Returns whether the mixer has taken every impulse, so that counts() is final.
  bool settled() const;

  /// Returns the reason of the newest rejection, or OK if no contact was rejected.
  absl::Status last_rejection() const { return intake_.last_rejection(); }

 private:
  class Target final : public EventTarget {
   public:
    Target(const Mixer& mixer, std::unique_ptr<EventStream> events)
        : mixer_(mixer), events_(std::move(events)) {}
    uint64_t frame() const override { return mixer_.frame(); }
    void Push(const MixerEvent& event) override {
      events_->TryPush(event);  // the stream counts events that a full queue drops
    }
    const EventStream& events() const { return *events_; }

   private:
    const Mixer& mixer_;
    const std::unique_ptr<EventStream> events_;
  };

  ContactStream(std::shared_ptr<Scene> scene, const Mixer& mixer, const IntakeSettings& settings,
                std::unique_ptr<EventStream> events);

  const std::shared_ptr<Scene> scene_;
  Target target_;
  ContactIntake intake_;
};

}  // namespace carillon
