// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "server/api/call/thread_pool.h"
#include "server/base/mutex.h"

namespace carillon {

/// Tasks of several clients for some of the threads of a pool. The clients have their turns one
/// after the other, and the tasks of one client never occupy more than half of these threads, so
/// that a client with much work cannot keep another client waiting for more than one task.
class FairTurns {
 public:
  /// The tasks occupy at most `most_running` threads of the pool at a time. The pool must end
  /// before this object is destroyed.
  FairTurns(ThreadPool& pool, int most_running)
      : pool_(pool), most_running_(most_running), most_of_client_(std::max(1, most_running / 2)) {}
  FairTurns(const FairTurns&) = delete;
  FairTurns& operator=(const FairTurns&) = delete;

  /// Runs a task of a client. Tasks of one client start in the order in which they were added.
  void Run(const std::string& client, std::function<void()> task);

 private:
  struct Client {
    std::deque<std::function<void()>> tasks;
    int turn_count = 0;     ///< its entries in turns_
    int running_count = 0;  ///< its tasks that run
  };

  void GiveTurns(const std::string& name, Client& client) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  /// Asks the pool for a thread for each turn, as far as the tasks may occupy further threads.
  void AskForThreads() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  /// Runs the task whose turn it is.
  void RunNext();

  ThreadPool& pool_;
  const int most_running_;
  const int most_of_client_;
  Mutex mutex_;
  std::map<std::string, Client> clients_ ABSL_GUARDED_BY(mutex_);
  /// The clients whose tasks may start, in order.
  std::deque<std::string> turns_ ABSL_GUARDED_BY(mutex_);
  int asked_count_ ABSL_GUARDED_BY(mutex_) = 0;    ///< threads that have not come yet
  int running_count_ ABSL_GUARDED_BY(mutex_) = 0;  ///< tasks that run
};

}  // namespace carillon
