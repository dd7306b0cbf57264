// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace carillon {

/// An open connection of this process's gRPC servers.
struct GrpcConnection {
  int64_t id = 0;    ///< gRPC's id; a later connection has a larger id
  std::string peer;  ///< the name that calls see (ServerContext::peer)
};

/// The calls that gRPC has counted on one connection since the connection was made.
struct ConnectionCalls {
  uint64_t begun_count = 0;
  uint64_t answered_count = 0;
  uint64_t failed_count = 0;   ///< calls that ended without an answer, as cancelled calls do
  uint64_t message_count = 0;  ///< whole messages that the client has sent

  /// Returns a number that grows with each call and message of the client.
  uint64_t progress() const noexcept { return begun_count + message_count; }

  /// Returns the number of open calls. gRPC reads its counts one after another while calls go on,
  /// so the count of ended calls may exceed the count of begun calls.
  uint64_t open_count() const noexcept {
    const uint64_t ended = answered_count + failed_count;
    return begun_count > ended ? begun_count - ended : 0;
  }
};

/// Returns the open connections from this id on, in the order of their ids, from gRPC's channelz.
std::vector<GrpcConnection> ListConnections(int64_t first_id);

/// Returns the counts of a connection, or nothing if the connection is closed. This takes some 10
/// us. gRPC's channelz counts a call when its first frame has come, before any service learns of
/// the call.
std::optional<ConnectionCalls> ReadConnectionCalls(int64_t id);

}  // namespace carillon
