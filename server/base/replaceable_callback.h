// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "server/base/mutex.h"

namespace carillon {

/// A function that is called without a lock and can be replaced meanwhile. Safe from every thread.
template <typename... Arguments>
class ReplaceableCallback {
 public:
  using Function = std::function<void(Arguments...)>;

  /// Replaces the function, which may be empty. When the call returns, the old function is not
  /// running, and it is never called again. Must not be called by the function.
  void Replace(Function function) {
    auto state = std::make_shared<State>(std::move(function));
    {
      const MutexLock lock(&mutex_);
      std::swap(state_, state);
    }
    // No call of the old function can begin any more.
    for (int count = state->running_count; count > 0; count = state->running_count) {
      state->running_count.wait(count);
    }
  }

  /// Calls the function if there is one.
  void Call(Arguments... arguments) {
    const std::shared_ptr<State> state = Begin();
    if (state->function) state->function(arguments...);
    if (--state->running_count == 0) state->running_count.notify_all();
  }

 private:
  struct State {
    explicit State(Function f) : function(std::move(f)) {}
    const Function function;
    std::atomic<int> running_count = 0;
  };

  std::shared_ptr<State> Begin() {
    const MutexLock lock(&mutex_);
    ++state_->running_count;
    return state_;
  }

  Mutex mutex_;
  std::shared_ptr<State> state_ ABSL_GUARDED_BY(mutex_) = std::make_shared<State>(nullptr);
};

}  // namespace carillon
