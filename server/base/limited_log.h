// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/strings/string_view.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"

namespace carillon {

/// A budget that starts full and refills by one a second.
class Allowance {
 public:
  explicit Allowance(double most) : most_(most), left_(most) {}

  /// Takes one unit. Returns false if no unit is left.
  bool Take(std::chrono::nanoseconds now);

  /// Returns whether a unit is left.
  bool Has(std::chrono::nanoseconds now);

  /// Returns whether the budget is full.
  bool IsFull(std::chrono::nanoseconds now);

 private:
  void Refill(std::chrono::nanoseconds now);

  double most_;
  double left_;
  std::chrono::nanoseconds refilled_{0};
};

/// A log that untrusted clients cannot flood. It takes twenty lines at once, then one a second.
/// Further lines are dropped, and their count and subject are logged before the next line. Bytes
/// that are not printable ASCII are escaped, and lines are cut at 400 bytes. Safe from every
/// thread.
class LimitedLog {
 public:
  using Sink = std::function<void(const std::string&)>;

  /// Number of lines that are taken at once.
  static constexpr double kMostAtOnce = 20;

  /// `subject` tells what the lines are about. `clock` must outlive the log.
  LimitedLog(const Clock& clock, std::string subject, Sink sink)
      : clock_(clock), subject_(std::move(subject)), sink_(std::move(sink)) {}

  /// Logs the number of lines that were dropped since the last one.
  ~LimitedLog();
  LimitedLog(const LimitedLog&) = delete;
  LimitedLog& operator=(const LimitedLog&) = delete;

  void Warn(absl::string_view line);

 private:
  void SayWhatWasLeftOut() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Clock& clock_;
  const std::string subject_;
  const Sink sink_;
  Mutex mutex_;
  Allowance lines_ ABSL_GUARDED_BY(mutex_){kMostAtOnce};
  uint64_t left_out_count_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace carillon
