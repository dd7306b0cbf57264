// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace carillon {

/// Logs when the sound begins to have gaps, and when it has none any more. Between these two lines
/// it is silent, so that a machine that is too busy for hours does not fill the log.
class LossLog {
 public:
  /// Takes a line for the operator.
  using Log = std::function<void(const std::string&)>;

  LossLog(uint32_t sample_rate_hz, Log log);

  /// Takes the number of frames lost so far, at a time that never decreases. `explained` means that
  /// the log already names the fault of the device that loses frames at present.
  void Note(uint64_t lost_frame_count, std::chrono::nanoseconds now, bool explained);

 private:
  /// Returns a number of frames as "4800 frames (0.1 s)".
  std::string Text(uint64_t frame_count) const;

  const double sample_rate_hz_;
  const Log log_;
  uint64_t seen_count_ = 0;  ///< lost frames at the last Note
  bool was_explained_ = false;
  uint64_t gap_frame_count_ = 0;  ///< lost frames since the sound began to have gaps
  /// Time of the last gap, while the sound has gaps.
  std::optional<std::chrono::nanoseconds> last_gap_;
};

}  // namespace carillon
