// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/socket.h>

#include <cstdint>
#include <string>

namespace carillon {

/// The name of a connection, as gRPC gives it to calls (ServerContext::peer): "ipv4:HOST:PORT",
/// "ipv6:%5BHOST%5D:PORT" or, for an accepted Unix socket, "unix:pid-PID/NUMBER". `address` is that
/// of the other end; `number` tells Unix connections apart.
std::string PeerNameOf(int connection, const sockaddr_storage& address, uint64_t number);

/// The process behind a Unix connection, "unix:pid-PID"; the whole name where the system does not
/// know the process, as beyond a namespace of processes, and of other connections.
std::string ProcessOfPeer(const std::string& peer);

/// While it exists, gRPC learns on this thread that the other end of a Unix connection has the name
/// that PeerNameOf made.
///
/// The other ends of Unix connections have no names, so that all of them would be one peer. gRPC
/// asks getpeername, which peer_name.cc defines in place of the C library's.
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
