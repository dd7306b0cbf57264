// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace carillon {

/// One message from the program carillon-audio to the daemon, sent as the bytes of this struct.
struct DeviceReport {
  enum class State : uint32_t {
    kOpen,     ///< the device is open; `text` describes it
    kPlaying,  ///< sent regularly while the device plays
    kFailed,   ///< the process ends; `code` and `text` are those of its Refusal
  };

  State state = State::kOpen;
  absl::StatusCode code = absl::StatusCode::kOk;
  double latency_s = 0;
  uint64_t xrun_count = 0;
  uint64_t lost_frame_count = 0;
  std::array<char, 1024> text{};  ///< ends with a zero

  void set_text(absl::string_view value) {
    value.substr(0, text.size() - 1).copy(text.data(), text.size() - 1);
  }
};

/// The descriptor of carillon-audio's socket to the daemon, of type SOCK_SEQPACKET. The device
/// plays once the daemon has sent one byte with the descriptor of the FrameRing's memory. When the
/// daemon closes its end, the process ends.
inline constexpr int kDaemonSocket = 0;

}  // namespace carillon
