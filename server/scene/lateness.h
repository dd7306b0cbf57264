// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "server/scene/time_mapping.h"

namespace carillon {

/// The time for which every step must come late until simulation time is mapped anew. A shorter
/// pause of the network is followed by steps that come at once and are in time again.
inline constexpr double kLateRunS = 0.25;

/// Notices that the steps of a simulation come late for good, and maps its time anew.
class Lateness {
 public:
  explicit Lateness(double sample_rate_hz) : sample_rate_hz_(sample_rate_hz) {}

  /// Notes that the step of simulation time `time_s` has come when `frame` was to be rendered next.
  /// If every step has come late for kLateRunS, moves `mapping` later by whole blocks, as if this
  /// step were the first.
  void Note(double time_s, uint64_t frame, TimeMapping& mapping);

  uint64_t remap_count() const { return remap_count_; }

 private:
  const double sample_rate_hz_;
  std::optional<uint64_t> since_frame_;  // when the first of the newest, unbroken late steps came
  uint64_t step_count_ = 0;              // number of these steps
  uint64_t remap_count_ = 0;
};

}  // namespace carillon
