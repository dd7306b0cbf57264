// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace carillon {

/// An open connection of this process's gRPC servers.
struct GrpcConnection {
  int64_t id = 0;    ///< gRPC's own; a later connection has a larger one
  std::string peer;  ///< the name that calls see (ServerContext::peer)
};

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

/// Returns the open connections from this id on, in the order of their ids. Source: gRPC's
/// channelz.
std::vector<GrpcConnection> ListConnections(int64_t first_id);

/// Returns the counts of a connection; absent if it is closed. It takes some 10 us. Source: gRPC's
/// channelz, which counts a call when its first frame has come, before any service learns of it.
std::optional<ConnectionCalls> ReadConnectionCalls(int64_t id);

}  // namespace carillon
