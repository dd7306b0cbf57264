// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/render_threads.h"

#include "server/synthesis/flush_denormals.h"

namespace carillon {

RenderThreads::RenderThreads(size_t thread_count) {
  for (size_t worker = 1; worker < thread_count; ++worker) {
    threads_.emplace_back([this, worker] { Help(worker); });
  }
}

RenderThreads::~RenderThreads() {
  stopping_ = true;
  ++round_;
  round_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void RenderThreads::Render(size_t count, absl::FunctionRef<void(size_t, size_t)> render) noexcept {
  render_ = &render;
  count_ = count;
  next_ = 0;
  helping_count_ = threads_.size();
  ++round_;
  round_.notify_all();
  Work(0);
  for (size_t left = helping_count_; left > 0; left = helping_count_) helping_count_.wait(left);
}

void RenderThreads::Help(size_t worker) {
  const FlushDenormals flush_denormals;
  for (uint32_t seen = 0;; ++seen) {
    round_.wait(seen);
    if (stopping_) return;
    Work(worker);
    if (--helping_count_ == 0) helping_count_.notify_one();
  }
}

void RenderThreads::Work(size_t worker) noexcept {
  for (size_t section = next_++; section < count_; section = next_++) (*render_)(worker, section);
}

}  // namespace carillon
