// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "precompute/sparse/mutex.h"

namespace carillon::precompute {

/// Threads that share a task and then wait for the next one.
class Workers {
 public:
  /// Makes `count` threads, including the caller's.
  explicit Workers(int count);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  int count() const { return static_cast<int>(threads_.size()) + 1; }

  /// Calls work(0) ... work(count() - 1), each in a thread of its own, and waits for all calls. If
  /// calls throw, rethrows one of the exceptions.
  void Run(const std::function<void(int)>& work);

  /// Calls visit(begin, end, t) for contiguous parts of 0 ... n - 1, part t in thread t. Parts
  /// begin at multiples of `unit`.
  void ForParts(int64_t n, int64_t unit, const std::function<void(int64_t, int64_t, int)>& visit);

  /// Calls visit(i) for 0 <= i < n. The next free thread makes the next call.
  void ForEach(int64_t n, const std::function<void(int64_t)>& visit);

 private:
  void Serve(int index);
  void Try(const std::function<void(int)>& work, int index);

  Mutex mutex_;
  Condition begun_;
  Condition ended_;
  const std::function<void(int)>* work_ ABSL_GUARDED_BY(mutex_) = nullptr;
  uint64_t round_ ABSL_GUARDED_BY(mutex_) = 0;
  int busy_ ABSL_GUARDED_BY(mutex_) = 0;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::exception_ptr thrown_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::thread> threads_;
};

}  // namespace carillon::precompute
