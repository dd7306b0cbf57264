// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/performance.pb.h"

namespace carillon::client {

/// The sound of one step. It is valid until the next call of Performance::Step.
struct PerformedStep {
  /// Element [environment][channel][frame]; the channels of all microphones in their order.
  std::span<const float> samples;
  uint32_t frame_count = 0;
  /// The rest of the daemon's answer: the impacts if the settings ask for them, the number of
  /// contacts and other parts of steps rejected so far, and why the last one was. It has no
  /// samples.
  const v1::PerformedSamples* findings = nullptr;
};

/// Environments whose sound comes in step with their simulation. Client::Perform begins them, and
/// the destructor ends them. The interface is abstract, so that tests can pass a fake.
///
/// Threads: one thread at a time may call the methods. Step() waits for the daemon's answer.
class Performance {
 public:
  virtual ~Performance() = default;

  /// Returns the daemon's answer to the settings: the sample rate, the number of channels and the
  /// latency in frames.
  virtual const v1::PerformanceBegun& begun() const = 0;

  /// Performs a step of all environments. A rejected part of a step is no error: see
  /// PerformedStep::findings. After an error the performance has ended.
  virtual absl::StatusOr<PerformedStep> Step(const v1::PerformStep& step) = 0;

  /// Ends the sound of environments at once, and lets them begin anew.
  virtual absl::Status Reset(const v1::PerformReset& reset) = 0;
};

}  // namespace carillon::client
