// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/socket.h>

#include <cstdint>
#include <string>

namespace carillon {

/// Returns the name of a connection that calls see (ServerContext::peer): "ipv4:HOST:PORT",
/// "ipv6:%5BHOST%5D:PORT" or, for an accepted Unix socket, "unix:pid-PID/NUMBER". `address` is the
/// address of the other end; `number` distinguishes Unix connections.
std::string PeerNameOf(int connection, const sockaddr_storage& address, uint64_t number);

/// Returns "unix:pid-PID", the process behind a Unix connection. Returns the whole name for other
/// connections, and if the system does not know the process, for instance because it is in another
/// PID namespace.
std::string ProcessOfPeer(const std::string& peer);

/// While this object exists, gRPC on this thread learns that the other end of a Unix connection has
/// the name that PeerNameOf made.
///
/// Without this object, all Unix connections would be one peer, because their other ends have no
/// names. gRPC calls getpeername, which peer_name.cc replaces.
class NamedPeer {
 public:
  explicit NamedPeer(const std::string& peer);
  ~NamedPeer();
  NamedPeer(const NamedPeer&) = delete;
  NamedPeer& operator=(const NamedPeer&) = delete;

 private:
  std::string path_;
};

}  // namespace carillon
