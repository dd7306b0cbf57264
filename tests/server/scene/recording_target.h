// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "server/scene/contact_intake.h"

namespace carillon {

/// Keeps the events that an intake hands on.
class RecordingTarget final : public EventTarget {
 public:
  uint64_t frame() const override { return now; }
  void Push(const MixerEvent& event) override { events.push_back(event); }

  uint64_t now = 0;
  std::vector<MixerEvent> events;
};

}  // namespace carillon
