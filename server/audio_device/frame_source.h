// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace carillon {

/// What a device plays: frames in order, interleaved, full scale is 1.
///
/// A device calls Pull on a thread of its own, again and again between Start and Stop, never from
/// two threads at once. With a sound card that thread has a deadline of one callback, so an
/// implementation must not
///  * allocate or free memory,
///  * lock, wait, or wake another thread,
///  * make a system call (read, write, sleep, log),
///  * throw,
///  * compute anything whose time depends on the load: it copies what was rendered ahead.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// Fills all of `frames`, with silence where nothing is ready.
  virtual void Pull(std::span<float> frames) noexcept = 0;
};

}  // namespace carillon
