// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/console/gateway/tunnel_frame.h"

#include <boost/endian/conversion.hpp>

namespace carillon::console {
namespace {

void AppendNumber(uint32_t number, std::string& bytes) {
  const uint32_t little = boost::endian::native_to_little(number);
  bytes.append(reinterpret_cast<const char*>(&little), sizeof(little));
}

}  // namespace

std::optional<TunnelFrame> ParseFrame(std::string_view bytes) {
  if (bytes.size() < kFrameHeadBytes) return std::nullopt;
  const auto kind = static_cast<uint8_t>(bytes[0]);
  if (kind > static_cast<uint8_t>(FrameKind::kCancel)) return std::nullopt;
  return TunnelFrame{
      .kind = static_cast<FrameKind>(kind),
      .call = boost::endian::load_little_u32(reinterpret_cast<const unsigned char*>(&bytes[1])),
      .body = bytes.substr(kFrameHeadBytes)};
}

std::string FrameHead(FrameKind kind, uint32_t call) {
  std::string head(1, static_cast<char>(kind));
  AppendNumber(call, head);
  return head;
}

std::string EndFrame(uint32_t call, const grpc::Status& status) {
  std::string frame = FrameHead(FrameKind::kEnd, call);
  AppendNumber(static_cast<uint32_t>(status.error_code()), frame);
  AppendNumber(static_cast<uint32_t>(status.error_message().size()), frame);
  return frame + status.error_message() + status.error_details();
}

}  // namespace carillon::console
