// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <thread>

namespace carillon {

/// A source of time. Code that depends on time gets it as an argument, so that a test can control
/// time. All threads may use it.
class Clock {
 public:
  virtual ~Clock() = default;

  /// Returns a time that never goes back, for durations and deadlines.
  virtual std::chrono::nanoseconds Monotonic() const noexcept = 0;

  /// Returns the milliseconds since 1970-01-01 UTC, for times that people read.
  virtual int64_t UnixMs() const noexcept = 0;

  /// Returns once Monotonic() has reached `time`.
  virtual void SleepUntil(std::chrono::nanoseconds time) {
    std::this_thread::sleep_for(time - Monotonic());
  }
};

/// The machine's clocks.
class SystemClock final : public Clock {
 public:
  std::chrono::nanoseconds Monotonic() const noexcept override {
    return std::chrono::steady_clock::now().time_since_epoch();
  }
  int64_t UnixMs() const noexcept override {
    return std::chrono::duration_cast<std::chrono::milliseconds>(
               std::chrono::system_clock::now().time_since_epoch())
        .count();
  }
};

}  // namespace carillon
