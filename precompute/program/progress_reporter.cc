// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/program/progress_reporter.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace carillon::precompute {
namespace {

/// Until the modes are counted there may be many more of them than guessed.
constexpr double kMostBeforeCount = 0.15;

/// The part of the whole work that is taken for done in a phase whose amount of work is unknown.
double FractionByPhase(v1::Phase phase) {
  if (phase == v1::PHASE_READ) return 0;
  return phase == v1::PHASE_MESH ? 0.01 : 0.05;
}

}  // namespace

ProgressReporter::ProgressReporter(std::function<void(const v1::Progress&)> show,
                                   std::chrono::milliseconds interval)
    : show_(std::move(show)), interval_(interval) {
  {
    const MutexLock lock(mutex_);
    state_.set_phase(v1::PHASE_READ);
  }
  thread_ = std::thread([this] { Run(); });
}

ProgressReporter::~ProgressReporter() { Stop(); }

void ProgressReporter::OnProgress(v1::Phase phase, double fraction) {
  const MutexLock lock(mutex_);
  if (phase != state_.phase()) clock_.Enter(phase);
  state_.set_phase(phase);
  state_.set_fraction(std::max(state_.fraction(), FractionByPhase(phase)));
  counted_ = counted_ || phase == v1::PHASE_FACTOR || phase == v1::PHASE_SOLVE;
  remaining_.Progress(WorkedSeconds(), phase, fraction);
  Estimate();
  if (phase != v1::PHASE_WRITE || fraction < 1) return;
  remaining_ = {};
  state_.clear_remaining_s();
  state_.set_fraction(1);
}

void ProgressReporter::OnRound(const RoundForecast& forecast) {
  const MutexLock lock(mutex_);
  remaining_.BeginRound(WorkedSeconds(), forecast);
}

void ProgressReporter::OnPlan(const std::vector<PlannedStep>& steps) {
  const MutexLock lock(mutex_);
  remaining_.Plan(WorkedSeconds(), steps);
}

void ProgressReporter::Estimate() {
  const double now_s = WorkedSeconds();
  const std::optional<double> remaining_s = remaining_.Seconds(now_s);
  state_.set_remaining_s(remaining_s.value_or(0) * work_.Slowdown());
  if (!remaining_s) return;
  const double done = now_s / std::max(now_s + *remaining_s, 1e-9);
  state_.set_fraction(
      std::max(state_.fraction(), counted_ ? done : std::min(done, kMostBeforeCount)));
}

double ProgressReporter::WorkedSeconds() {
  work_.Advance(WorkClock::Now());
  return work_.seconds();
}

void ProgressReporter::OnExtent(double extent_m) {
  const MutexLock lock(mutex_);
  state_.set_extent_m(extent_m);
}

void ProgressReporter::OnMesh(size_t node_count) {
  const MutexLock lock(mutex_);
  state_.set_node_count(static_cast<uint32_t>(node_count));
}

void ProgressReporter::OnModes(size_t mode_count) {
  const MutexLock lock(mutex_);
  state_.set_converged_mode_count(static_cast<uint32_t>(mode_count));
}

void ProgressReporter::Stop() {
  {
    const MutexLock lock(mutex_);
    if (stopping_) return;
    stopping_ = true;
    clock_.Stop();
  }
  wake_.NotifyOne();
  thread_.join();
}

v1::Progress ProgressReporter::state() const {
  const MutexLock lock(mutex_);
  return state_;
}

void ProgressReporter::Run() {
  for (bool last = false; !last;) {
    v1::Progress state;
    {
      MutexLock lock(mutex_);
      Estimate();
      state = state_;
      last = stopping_;
    }
    show_(state);
    MutexLock lock(mutex_);
    // The end of the program need not wait for the next interval.
    if (!last && !stopping_) wake_.WaitFor(lock, interval_);
  }
}

}  // namespace carillon::precompute
