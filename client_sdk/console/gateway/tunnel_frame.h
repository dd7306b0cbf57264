// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/support/status.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace carillon::console {

/// What a frame of the tunnel says. A frame is one binary message of the WebSocket: the kind (1
/// byte), the number of the call that the browser chose (4 bytes, little endian), and the body.
enum class FrameKind : uint8_t {
  kOpen = 0,  ///< From the browser; the body is the path of the method, "/package.Service/Method".
  kMessage = 1,    ///< In both directions; the body is one serialized message.
  kHalfClose = 2,  ///< From the browser: no further message of the call follows.
  kCancel = 3,     ///< From the browser: the call ends now.
  kEnd = 4,        ///< To the browser: the status; nothing of the call follows.
};

/// A frame whose body refers to the bytes that were parsed.
struct TunnelFrame {
  FrameKind kind = FrameKind::kOpen;
  uint32_t call = 0;
  std::string_view body;
};

/// The bytes before the body.
inline constexpr size_t kFrameHeadBytes = 5;

/// Reads a frame that a browser sent; nothing if `bytes` are too short or the kind is not one that
/// a browser sends.
std::optional<TunnelFrame> ParseFrame(std::string_view bytes);

/// Returns the head of a frame, to which the body is appended.
std::string FrameHead(FrameKind kind, uint32_t call);

/// Returns the whole frame kEnd: the code (u32), the length of the message (u32), the message, and
/// then the bytes of grpc-status-details-bin, from which the browser reads the ErrorInfo.
std::string EndFrame(uint32_t call, const grpc::Status& status);

}  // namespace carillon::console
