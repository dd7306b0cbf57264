// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "server/base/clock.h"

namespace carillon {

/// The time at which the first of the daemon's certificates expires. Any thread may call all
/// functions except WarningDue, which only one thread at a time may call.
class CertificateEnd {
 public:
  /// Number of days before the end in which the daemon warns.
  static constexpr int kWarningDays = 30;

  /// `clock` must outlive the object.
  explicit CertificateEnd(const Clock& clock) : clock_(clock) {}

  /// Sets the time, or 0 if no certificates are in use.
  void Set(int64_t unix_s) { end_unix_s_ = unix_s; }

  /// Returns that time, or 0 if no certificates are in use.
  int64_t unix_s() const { return end_unix_s_; }

  /// Returns the seconds until that time, negative after it, or nothing if no certificates are in
  /// use.
  std::optional<double> left_s() const;

  /// Returns a line for the log if the end is near and no warning was due within the last day.
  std::optional<std::string> WarningDue();

 private:
  const Clock& clock_;
  std::atomic<int64_t> end_unix_s_{0};
  std::optional<std::chrono::nanoseconds> warned_;
};

}  // namespace carillon
