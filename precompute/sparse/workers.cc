// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/sparse/workers.h"

#include <algorithm>
#include <atomic>
#include <utility>

namespace carillon::precompute {

Workers::Workers(int count) {
  for (int t = 1; t < count; ++t) threads_.emplace_back([this, t] { Serve(t); });
}

Workers::~Workers() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  begun_.NotifyAll();
  for (std::thread& thread : threads_) thread.join();
}

void Workers::Run(const std::function<void(int)>& work) {
  if (threads_.empty()) {
    work(0);
    return;
  }
  {
    const MutexLock lock(mutex_);
    work_ = &work;
    busy_ = static_cast<int>(threads_.size());
    ++round_;
  }
  begun_.NotifyAll();
  Try(work, 0);
  MutexLock lock(mutex_);
  while (busy_ > 0) ended_.Wait(lock);
  if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
}

void Workers::Try(const std::function<void(int)>& work, int index) {
  try {
    work(index);
  } catch (...) {
    const MutexLock lock(mutex_);
    thrown_ = std::current_exception();
  }
}

void Workers::ForParts(int64_t n, int64_t unit,
                       const std::function<void(int64_t, int64_t, int)>& visit) {
  const int64_t units = (n + unit - 1) / unit;
  Run([&](int t) {
    const int64_t begin = units * t / count() * unit;
    const int64_t end = std::min(n, units * (t + 1) / count() * unit);
    if (begin < end) visit(begin, end, t);
  });
}

void Workers::ForEach(int64_t n, const std::function<void(int64_t)>& visit) {
  std::atomic<int64_t> next = 0;
  Run([&](int) {
    for (int64_t i = next++; i < n; i = next++) visit(i);
  });
}

void Workers::Serve(int index) {
  uint64_t seen = 0;
  while (true) {
    const std::function<void(int)>* work = nullptr;
    {
      MutexLock lock(mutex_);
      while (!stopping_ && round_ == seen) begun_.Wait(lock);
      if (stopping_) return;
      seen = round_;
      work = work_;
    }
    Try(*work, index);
    const MutexLock lock(mutex_);
    if (--busy_ == 0) ended_.NotifyOne();
  }
}

}  // namespace carillon::precompute
