// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace carillon {

/// What gRPC has counted on one connection since it was made.
struct ConnectionCalls {
  uint64_t begun_count = 0;
  uint64_t answered_count = 0;
  uint64_t failed_count = 0;  ///< calls that ended without an answer: cancelled, for instance

  /// Calls go on while gRPC reads its counts one after another, so that more may have ended than
  /// had begun.
  uint64_t open_count() const noexcept {
    const uint64_t ended = answered_count + failed_count;
    return begun_count > ended ? begun_count - ended : 0;
  }
};

/// Returns the counts of each open connection of this process's gRPC servers, by the name that
/// calls see (ServerContext::peer). It takes about 20 us for a connection. Source: gRPC's channelz,
/// which counts a call when its first frame has come, before any service learns of it.
std::map<std::string, ConnectionCalls> ReadConnectionCalls();

}  // namespace carillon
