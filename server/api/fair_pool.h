// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "server/base/mutex.h"

namespace carillon {

/// Threads that several clients share. The clients have their turns one after the other, and the
/// tasks of one client never occupy more than half of the threads, so that a client with much work
/// cannot keep another client waiting for more than one task.
class FairPool {
 public:
  explicit FairPool(int thread_count);

  /// Runs all tasks added so far, then joins the threads.
  ~FairPool();
  FairPool(const FairPool&) = delete;
  FairPool& operator=(const FairPool&) = delete;

  /// Runs a task of a client. Tasks of one client start in the order in which they were added.
  void Run(const std::string& client, std::function<void()> task);

 private:
  struct Client {
    std::deque<std::function<void()>> tasks;
    int turn_count = 0;     ///< its entries in turns_
    int running_count = 0;  ///< its tasks that run
  };

  void RunTasks();
  /// Waits for a turn. Returns false once the pool ends and no task is left.
  bool RunNext();
  void GiveTurns(const std::string& name, Client& client) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const int most_running_;
  Mutex mutex_;
  std::map<std::string, Client> clients_ ABSL_GUARDED_BY(mutex_);
  /// The clients whose tasks may start, in order.
  std::deque<std::string> turns_ ABSL_GUARDED_BY(mutex_);
  /// Counts the turns; the destructor adds one for each thread.
  std::counting_semaphore<> ready_{0};
  std::vector<std::thread> threads_;
};

}  // namespace carillon
