// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "server/base/event.h"
#include "server/decomposition/phase_usage.h"

namespace carillon {

struct QueueSettings {
  size_t max_queued_count = 1024;
  size_t max_queued_count_of_client = 512;
  /// Whether a transfer is computed after each model whose request does not exclude it.
  bool transfers = false;
  /// Takes log lines about events that no call reports. Any thread may call it.
  std::function<void(const std::string& line)> log = [](const std::string&) {};
  /// Takes the failures and results of jobs, within limits (JobEvents).
  EventSink log_event = [](const Event&) {};
};

/// The numbers of jobs that wait, that run, and that have ended since the queue was made.
struct QueueCounts {
  size_t queued = 0;
  size_t running = 0;
  uint64_t succeeded = 0;
  uint64_t failed = 0;
  uint64_t cancelled = 0;
  PhaseUses phases{};
};

}  // namespace carillon
