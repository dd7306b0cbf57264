// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

namespace carillon {

/// The bytes of a TCP connection since it was made.
struct TcpBytes {
  uint64_t received = 0;      ///< bytes that have come
  uint64_t acknowledged = 0;  ///< bytes that the peer has received
};

/// Returns the counts of a TCP socket. Returns nothing for another descriptor, such as a Unix
/// socket, of which the system does not count the bytes.
std::optional<TcpBytes> CountTcpBytes(int descriptor);

}  // namespace carillon
