// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// Events that wait for their frame, in order of their first samples. Events of one sample keep the
/// order in which they came, because live events do, too. Memory is taken for the events that wait,
/// and for about as many that have been taken already.
class WaitingEvents {
 public:
  void Push(const MixerEvent& event) { events_.push_back(event); }

  /// Brings the events that were pushed since the last call into order. The functions below see
  /// only events that have been sorted.
  void Sort();

  size_t size() const { return events_.size() - taken_count_; }

  /// The event that comes at place `i`, below size().
  const MixerEvent& operator[](size_t i) const { return events_[taken_count_ + i]; }

  /// Removes the first event.
  void Pop() { ++taken_count_; }

 private:
  std::vector<MixerEvent> events_;
  size_t taken_count_ = 0;   // events in front that were removed
  size_t sorted_count_ = 0;  // events in front that are in order
};

}  // namespace carillon
