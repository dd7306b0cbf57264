// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace carillon {

/// A source of the frames that a device plays, in order and interleaved; full scale is 1.
///
/// Between Start and Stop a device calls Pull repeatedly on a thread of its own, never on two
/// threads at once. With a sound card each call has a deadline, so an implementation must not
///  * allocate or free memory,
///  * lock, wait, or wake another thread,
///  * make a system call (read, write, sleep, log),
///  * throw,
///  * compute anything whose time depends on the load: it only copies frames rendered ahead.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// Fills all of `frames`, with silence in place of frames that are not ready.
  virtual void Pull(std::span<float> frames) noexcept = 0;

  /// Returns the descriptor of the memory from which another process can pull the same frames (see
  /// FrameRing), or -1 if there is no such memory.
  virtual int shared_memory() const { return -1; }
};

}  // namespace carillon
