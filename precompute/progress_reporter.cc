// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/progress_reporter.h"

#include <algorithm>
#include <array>
#include <utility>

namespace carillon::precompute {
namespace {

/// Where in the whole work each phase begins and ends: measured on tubes and solid boxes of 20,000
/// nodes.
constexpr std::array<double, kPhaseCount + 1> kPhaseBounds = {0,    0.02, 0.10, 0.12,
                                                              0.25, 0.93, 0.98, 1};

double FractionOfWhole(Phase phase, double fraction) {
  const auto k = static_cast<size_t>(phase);
  return kPhaseBounds[k] + std::clamp(fraction, 0.0, 1.0) * (kPhaseBounds[k + 1] - kPhaseBounds[k]);
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
  state_.fraction = std::max(state_.fraction, FractionOfWhole(phase, fraction));
}

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
