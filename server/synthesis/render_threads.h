// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

#include "absl/functional/function_ref.h"

namespace carillon {

/// Distributes the sections of a mixer over threads.
class SectionThreads {
 public:
  virtual ~SectionThreads() = default;

  /// Number of threads, the caller's included.
  virtual size_t size() const noexcept = 0;

  /// Calls render(thread, section) once for each section below `count`, with thread below size().
  /// Calls with the same `thread` do not overlap. Returns when all calls have returned.
  virtual void Render(size_t count, absl::FunctionRef<void(size_t, size_t)> render) noexcept = 0;
};

/// Threads that render in addition to the caller's thread. They are for offline rendering only,
/// because they wait in the kernel.
class RenderThreads final : public SectionThreads {
 public:
  /// Throws std::system_error if the system refuses a thread.
  explicit RenderThreads(size_t thread_count);
  ~RenderThreads() override;
  RenderThreads(const RenderThreads&) = delete;
  RenderThreads& operator=(const RenderThreads&) = delete;

  size_t size() const noexcept override { return threads_.size() + 1; }
  void Render(size_t count, absl::FunctionRef<void(size_t, size_t)> render) noexcept override;

 private:
  void Run(size_t thread);
  void Stop();
  void RenderSome(size_t thread) noexcept;

  const absl::FunctionRef<void(size_t, size_t)>* render_ = nullptr;
  size_t count_ = 0;
  std::atomic<size_t> next_{0};
  std::atomic<uint32_t> round_{0};
  /// The threads that render, and kClosed once no section is left to be begun: Render does not wait
  /// for a thread to which a busy machine has given no processor since.
  static constexpr uint32_t kClosed = uint32_t{1} << 31;
  std::atomic<uint32_t> busy_{kClosed};
  std::atomic<bool> stopping_{false};
  std::vector<std::thread> threads_;
};

}  // namespace carillon
