// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/idle_calls.h"

#include <utility>

namespace carillon {

bool ClientWait::Resume() {
  const MutexLock lock(&mutex_);
  if (std::exchange(waits_, false)) waited_ += clock_.Monotonic() - since_;
  return !ended_;
}

void ClientWait::Begin() {
  const MutexLock lock(&mutex_);
  waits_ = true;
  since_ = clock_.Monotonic();
}

bool ClientWait::EndIfLonger(std::chrono::nanoseconds limit) {
  const MutexLock lock(&mutex_);
  if (!waits_ || ended_ || clock_.Monotonic() - since_ < limit) return false;
  return ended_ = true;
}

bool ClientWait::EndIfAllLonger(std::chrono::nanoseconds limit) {
  const MutexLock lock(&mutex_);
  if (!waits_ || ended_ || waited_ + (clock_.Monotonic() - since_) < limit) return false;
  return ended_ = true;
}

void IdleCalls::Add(IdleCall& call) {
  const RecursiveMutexLock lock(&mutex_);
  calls_.insert(&call);
}

void IdleCalls::Remove(IdleCall& call) {
  const RecursiveMutexLock lock(&mutex_);
  calls_.erase(&call);
}

void IdleCalls::EndIdle(std::chrono::nanoseconds limit) {
  const RecursiveMutexLock lock(&mutex_);
  for (IdleCall* call : std::set<IdleCall*>(calls_)) {
    if (calls_.contains(call)) call->EndIfIdle(limit);
  }
}

}  // namespace carillon
