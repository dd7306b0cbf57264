// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "server/base/mutex.h"

namespace carillon {

/// The time that gRPC's threads may spend on the contact steps of one client, and the large
/// messages of the client that wait for other threads. The time grows by a fifth of the time that
/// passes, up to 20 ms. Safe from every thread.
class StepBudget {
 public:
  /// Returns whether time is left.
  bool Allows(std::chrono::nanoseconds now);
  void Spend(std::chrono::nanoseconds time);

  /// Notes the bytes of a large message that waits for a thread. Returns false, and notes nothing,
  /// if more than kMostWaitingBytes would wait.
  bool Hold(size_t byte_count);
  void Release(size_t byte_count);

  static constexpr size_t kMostWaitingBytes = size_t{64} << 20U;

 private:
  static constexpr std::chrono::nanoseconds kMost = std::chrono::milliseconds(20);
  static constexpr int kShare = 5;

  Mutex mutex_;
  std::chrono::nanoseconds left_ ABSL_GUARDED_BY(mutex_) = kMost;
  size_t waiting_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  std::chrono::nanoseconds known_at_ ABSL_GUARDED_BY(mutex_){0};
};

/// The budgets of the clients that have contact streams. Safe from every thread.
class StepBudgets {
 public:
  /// Returns the budget that all streams of a client share.
  std::shared_ptr<StepBudget> Of(const std::string& client);

 private:
  Mutex mutex_;
  std::map<std::string, std::weak_ptr<StepBudget>> budgets_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
