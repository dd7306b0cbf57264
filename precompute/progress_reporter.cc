// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/progress_reporter.h"

#include <algorithm>
#include <utility>

namespace carillon::precompute {
namespace {

/// Until the modes are counted there may be many more of them than guessed.
constexpr double kMostBeforeCount = 0.15;

/// Of the whole work, about, before anybody knows how much there is.
double FractionByPhase(Phase phase) {
  if (phase == Phase::kRead) return 0;
  return phase == Phase::kMesh ? 0.01 : 0.05;
}

}  // namespace

ProgressReporter::ProgressReporter(std::function<void(const ProgressState&)> show,
                                   std::chrono::milliseconds interval)
    : show_(std::move(show)), interval_(interval), thread_([this] { Run(); }) {}

ProgressReporter::~ProgressReporter() { Stop(); }

void ProgressReporter::OnProgress(Phase phase, double fraction) {
  const std::lock_guard lock(mutex_);
  if (phase != state_.phase) clock_.Enter(phase);
  state_.phase = phase;
  state_.fraction = std::max(state_.fraction, FractionByPhase(phase));
  counted_ = counted_ || phase == Phase::kFactor || phase == Phase::kSolve;
  remaining_.Progress(Now(), phase, fraction);
  Estimate();
  if (phase != Phase::kWrite || fraction < 1) return;
  remaining_ = {};
  state_.remaining_s.reset();
  state_.fraction = 1;
}

void ProgressReporter::OnRound(const RoundForecast& forecast) {
  const std::lock_guard lock(mutex_);
  remaining_.BeginRound(Now(), forecast);
}

void ProgressReporter::OnPlan(const std::vector<PlannedStep>& steps) {
  const std::lock_guard lock(mutex_);
  remaining_.Plan(Now(), steps);
}

void ProgressReporter::Estimate() {
  const double now_s = Now();
  state_.remaining_s = remaining_.Seconds(now_s);
  if (!state_.remaining_s) return;
  const double whole_s = std::max(now_s + *state_.remaining_s, 1e-9);
  const double done = now_s / whole_s;
  state_.fraction = std::max(state_.fraction, counted_ ? done : std::min(done, kMostBeforeCount));
}

double ProgressReporter::Now() const { return PhaseClock::Now().seconds - begun_s_; }

void ProgressReporter::OnMesh(size_t node_count, size_t element_count) {
  const std::lock_guard lock(mutex_);
  state_.node_count = node_count;
  state_.element_count = element_count;
}

void ProgressReporter::OnModes(size_t mode_count) {
  const std::lock_guard lock(mutex_);
  state_.mode_count = mode_count;
}

void ProgressReporter::Stop() {
  {
    const std::lock_guard lock(mutex_);
    if (stopping_) return;
    stopping_ = true;
    clock_.Stop();
  }
  wake_.notify_one();
  thread_.join();
}

ProgressState ProgressReporter::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void ProgressReporter::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    Estimate();
    const ProgressState state = state_;
    const bool last = stopping_;
    lock.unlock();
    show_(state);
    if (last) return;
    lock.lock();
    wake_.wait_for(lock, interval_, [this] { return stopping_; });
  }
}

}  // namespace carillon::precompute
