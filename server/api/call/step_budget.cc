// SPDX-License-Identifier: Apache-2.0
#include "server/api/call/step_budget.h"

#include <algorithm>

namespace carillon {

bool StepBudget::Allows(std::chrono::nanoseconds now) {
  const MutexLock lock(&mutex_);
  if (now > known_at_) left_ = std::min(kMost, left_ + (now - known_at_) / kShare);
  known_at_ = std::max(known_at_, now);
  return left_.count() > 0;
}

void StepBudget::Spend(std::chrono::nanoseconds time) {
  const MutexLock lock(&mutex_);
  left_ -= time;
}

bool StepBudget::Hold(size_t byte_count) {
  const MutexLock lock(&mutex_);
  if (waiting_bytes_ + byte_count > kMostWaitingBytes) return false;
  waiting_bytes_ += byte_count;
  return true;
}

void StepBudget::Release(size_t byte_count) {
  const MutexLock lock(&mutex_);
  waiting_bytes_ -= byte_count;
}

std::shared_ptr<StepBudget> StepBudgets::Of(const std::string& client) {
  const MutexLock lock(&mutex_);
  std::erase_if(budgets_, [](const auto& entry) { return entry.second.expired(); });
  std::weak_ptr<StepBudget>& known = budgets_[client];
  std::shared_ptr<StepBudget> budget = known.lock();
  if (budget == nullptr) known = budget = std::make_shared<StepBudget>();
  return budget;
}

}  // namespace carillon
