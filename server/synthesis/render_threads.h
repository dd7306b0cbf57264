// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

#include "absl/functional/function_ref.h"

namespace carillon {

/// Renders the sections of a mixer.
class SectionThreads {
 public:
  virtual ~SectionThreads() = default;

  /// How many threads work, the caller's included.
  virtual size_t size() const noexcept = 0;

  /// Calls render(worker, section) once for each section below `count`, worker below size(); no two
  /// calls of one worker at once. Returns when all are done.
  virtual void Render(size_t count, absl::FunctionRef<void(size_t, size_t)> render) noexcept = 0;
};

/// Threads that render together with the caller's. For offline rendering only: they wait in the
/// kernel.
class RenderThreads final : public SectionThreads {
 public:
  explicit RenderThreads(size_t thread_count);
  ~RenderThreads() override;
  RenderThreads(const RenderThreads&) = delete;
  RenderThreads& operator=(const RenderThreads&) = delete;

  size_t size() const noexcept override { return threads_.size() + 1; }
  void Render(size_t count, absl::FunctionRef<void(size_t, size_t)> render) noexcept override;

 private:
  void Help(size_t worker);
  void Work(size_t worker) noexcept;

  const absl::FunctionRef<void(size_t, size_t)>* render_ = nullptr;
  size_t count_ = 0;
  std::atomic<size_t> next_{0};
  std::atomic<uint32_t> round_{0};
  std::atomic<size_t> helping_count_{0};
  std::atomic<bool> stopping_{false};
  std::vector<std::thread> threads_;
};

}  // namespace carillon
