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
  if (count <= 1 || threads_.empty()) {
    for (size_t section = 0; section < count; ++section) render(0, section);
    return;
  }
  render_ = &render;
  count_ = count;
  next_ = 0;
  busy_ &= ~kClosed;
  ++round_;
  round_.notify_all();
  RenderSome(0);
  for (uint32_t busy = busy_ |= kClosed; busy != kClosed; busy = busy_) busy_.wait(busy);
}

void RenderThreads::Run(size_t thread) {
  const FlushDenormals flush_denormals;
  for (uint32_t seen = 0;; ++seen) {
    round_.wait(seen);
    if (stopping_) return;
    if ((busy_++ & kClosed) == 0) RenderSome(thread);
    if (--busy_ == kClosed) busy_.notify_one();
  }
}

void RenderThreads::RenderSome(size_t thread) noexcept {
  for (size_t section = next_++; section < count_; section = next_++) (*render_)(thread, section);
}

}  // namespace carillon
