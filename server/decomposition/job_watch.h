// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <utility>

namespace carillon {

/// Ends a watch when it is destroyed. After that, the watch's function is neither running nor
/// called again. The function itself may destroy the JobWatch. The caller must hold no lock that
/// the function takes. A watch may outlive the queue.
class JobWatch {
 public:
  explicit JobWatch(std::function<void()> end) : end_(std::move(end)) {}
  JobWatch(const JobWatch&) = delete;
  JobWatch& operator=(const JobWatch&) = delete;
  ~JobWatch() { end_(); }

 private:
  const std::function<void()> end_;
};

}  // namespace carillon
