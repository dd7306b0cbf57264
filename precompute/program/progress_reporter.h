// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "precompute/pipeline/decomposition_observer.h"
#include "precompute/pipeline/phase_clock.h"
#include "precompute/program/remaining_time.h"
#include "precompute/program/work_clock.h"
#include "precompute/sparse/mutex.h"

namespace carillon::precompute {

/// Keeps the state of a decomposition and shows it at a steady rate from a thread of its own, so
/// that a user sees that a long factorization is still running.
class ProgressReporter : public DecompositionObserver {
 public:
  /// The reporter's thread calls `show` every `interval` and once at the end.
  ProgressReporter(std::function<void(const v1::Progress&)> show,
                   std::chrono::milliseconds interval);
  ~ProgressReporter() override;

  void OnProgress(v1::Phase phase, double fraction) override;
  void OnRound(const RoundForecast& forecast) override;
  void OnPlan(const std::vector<PlannedStep>& steps) override;
  void OnExtent(double extent_m) override;
  void OnMesh(size_t node_count) override;
  void OnModes(size_t mode_count) override;

  /// Shows the last state and ends the thread.
  void Stop();

  v1::Progress state() const;
  /// May be called after Stop only.
  const PhaseClock& clock() const { return clock_; }

 private:
  void Run();
  /// Returns the seconds that the process has worked.
  double WorkedSeconds() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  /// Updates the fraction and the remaining time.
  void Estimate() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  std::function<void(const v1::Progress&)> show_;
  std::chrono::milliseconds interval_;
  mutable Mutex mutex_;
  Condition wake_;
  v1::Progress state_ ABSL_GUARDED_BY(mutex_);
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  PhaseClock clock_;  ///< changed under mutex_ until Stop, and constant afterwards
  WorkClock work_ ABSL_GUARDED_BY(mutex_);
  RemainingTime remaining_ ABSL_GUARDED_BY(mutex_);  ///< in seconds of work
  bool counted_ ABSL_GUARDED_BY(mutex_) = false;     ///< whether the number of modes is known
  std::thread thread_;
};

}  // namespace carillon::precompute
