// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/schedule/work_budget.h"

#include <algorithm>

namespace carillon {
namespace {

/// Each block moves the estimate up or down by this factor. The estimate follows the median, so a
/// block in which the thread was preempted has little effect.
constexpr double kAdjustment = 1.02;
/// Blocks with less work than this part of the bound are not measured: fixed costs dominate them.
constexpr double kLeastMeasured = 0.05;
constexpr double kLeastNsPerUnit = 0.1;
constexpr double kMostNsPerUnit = 100;

}  // namespace

WorkBudget::WorkBudget(const Clock* clock, double block_s, double most_load)
    : clock_(clock), most_ns_(most_load * block_s * 1e9) {}

void WorkBudget::Begin() noexcept {
  if (clock_ != nullptr) begin_ = clock_->Monotonic();
}

void WorkBudget::End(double units, double block_count) noexcept {
  if (clock_ == nullptr || units < kLeastMeasured * most_work() * block_count) return;
  const auto elapsed_ns = static_cast<double>((clock_->Monotonic() - begin_).count());
  const bool slower = elapsed_ns > units * ns_per_unit_;
  ns_per_unit_ = std::clamp(slower ? ns_per_unit_ * kAdjustment : ns_per_unit_ / kAdjustment,
                            kLeastNsPerUnit, kMostNsPerUnit);
}

}  // namespace carillon
