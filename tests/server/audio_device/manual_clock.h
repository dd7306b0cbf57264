// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>

#include "server/base/clock.h"

namespace carillon {

/// Time that passes only by sleeping, and at once.
class ManualClock final : public Clock {
 public:
  std::chrono::nanoseconds Monotonic() const noexcept override { return now_.load(); }
  int64_t UnixMs() const noexcept override { return 0; }
  void SleepUntil(std::chrono::nanoseconds time) override { now_ = time; }

 private:
  std::atomic<std::chrono::nanoseconds> now_{std::chrono::nanoseconds(0)};
};

}  // namespace carillon
