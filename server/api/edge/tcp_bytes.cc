// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/tcp_bytes.h"

// The tcp_info of <netinet/tcp.h> has no tcpi_bytes_received.
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace carillon {

std::optional<TcpBytes> CountTcpBytes(int descriptor) {
  tcp_info info{};
  socklen_t size = sizeof info;
  if (getsockopt(descriptor, IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return std::nullopt;
  return TcpBytes{.received = info.tcpi_bytes_received, .acknowledged = info.tcpi_bytes_acked};
}

}  // namespace carillon
