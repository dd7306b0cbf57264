// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "server/base/clock.h"

namespace carillon {

/// When the daemon's certificates expire. All functions may be called from any thread but
/// WarningDue, which one thread calls.
class CertificateEnd {
 public:
  /// Days before the end in which the daemon warns.
  static constexpr int kWarningDays = 30;

  /// `clock` must outlive the object.
  explicit CertificateEnd(const Clock& clock) : clock_(clock) {}

  /// New files are in use, of which the first expires at this time; 0: none are in use.
  void Set(int64_t unix_s) { end_unix_s_ = unix_s; }

  /// 0: no certificates are in use.
  int64_t unix_s() const { return end_unix_s_; }

  /// Seconds until the end, negative after it; nothing if no certificates are in use.
  std::optional<double> left_s() const;

  /// A line for the log if the end is near and none was due within a day; else nothing.
  std::optional<std::string> WarningDue();

 private:
  const Clock& clock_;
  std::atomic<int64_t> end_unix_s_{0};
  std::optional<std::chrono::nanoseconds> warned_;
};

}  // namespace carillon
