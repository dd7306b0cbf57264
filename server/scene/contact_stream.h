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

/// How a contact stream maps simulation time to audio time.
struct ContactStreamSettings {
  double step_s = 0;  ///< the simulator's step: above 0, at most 1
  /// 0 to 10; absent: one step, one block and 5 ms for the network.
  std::optional<double> scheduling_delay_s = std::nullopt;
  /// Each contact sounds when it comes, with no scheduling delay but its own time offset.
  bool at_once = false;
  ContactReading reading{};
  RejectionCounts* rejections = nullptr;  ///< as in IntakeSettings
};

/// The numbers of a stream's steps, and of its impulses by what became of them.
struct ContactCounts {
  uint64_t step_count = 0;
  uint64_t accepted_count = 0;
  uint64_t late_count = 0;
  uint64_t dropped_count = 0;
  uint64_t rejected_count = 0;
  uint64_t remap_count = 0;  ///< how many times simulation time was mapped anew
};

/// The contacts of one simulator that runs now: an intake whose events go through a queue to the
/// live mixer. One thread at a time.
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

  /// The mixer's frame that the first step's time is mapped to, less the scheduling delay; absent
  /// before it has come.
  std::optional<uint64_t> first_frame() const {
    return intake_.step_count() > 0 ? std::optional(intake_.mapping().first_frame) : std::nullopt;
  }

  /// Impulses that the mixer has not taken yet are in none of the counts.
  ContactCounts counts() const;

  /// True if the mixer has taken every impulse: counts() is final.
  bool settled() const;

  /// Why the newest rejected impulse could not be used; OK if none was rejected.
  const absl::Status& last_rejection() const { return intake_.last_rejection(); }

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
