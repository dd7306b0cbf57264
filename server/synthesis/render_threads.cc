// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/render_threads.h"

#include <exception>

#include "server/synthesis/flush_denormals.h"

namespace carillon {

RenderThreads::RenderThreads(size_t thread_count) {
  try {
    for (size_t thread = 1; thread < thread_count; ++thread) {
      threads_.emplace_back([this, thread] { Run(thread); });
    }
  } catch (const std::exception&) {
    Stop();
    throw;
  }
}

RenderThreads::~RenderThreads() { Stop(); }

void RenderThreads::Stop() {
  stopping_ = true;
  ++round_;
  round_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void RenderThreads::Render(size_t count, absl::FunctionRef<void(size_t, size_t)> render) noexcept {
  render_ = &render;
  count_ = count;
  next_ = 0;
  busy_count_ = threads_.size();
  ++round_;
  round_.notify_all();
  RenderSome(0);
  for (size_t left = busy_count_; left > 0; left = busy_count_) busy_count_.wait(left);
}

void RenderThreads::Run(size_t thread) {
  const FlushDenormals flush_denormals;
  for (uint32_t seen = 0;; ++seen) {
    round_.wait(seen);
    if (stopping_) return;
    RenderSome(thread);
    if (--busy_count_ == 0) busy_count_.notify_one();
  }
}

void RenderThreads::RenderSome(size_t thread) noexcept {
  for (size_t section = next_++; section < count_; section = next_++) (*render_)(thread, section);
}

}  // namespace carillon
