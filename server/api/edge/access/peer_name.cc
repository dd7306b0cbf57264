// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/access/peer_name.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"

namespace carillon {
namespace {

/// The name that the other end of Unix connections has on this thread. If it is null, getpeername
/// returns the system's name.
thread_local const std::string* named_path = nullptr;

pid_t ProcessBehind(int connection) {
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (getsockopt(connection, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) return 0;
  return credentials.pid;
}

std::string TextOf(int family, const void* address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  return inet_ntop(family, address, text.data(), text.size()) == nullptr ? "" : text.data();
}

/// Writes a name in the form in which the system writes the path of a bound socket.
void WritePath(const std::string& path, sockaddr* address, socklen_t* length) {
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  path.copy(name.sun_path, sizeof(name.sun_path) - 1);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size() + 1);
  std::memcpy(address, &name, std::min<size_t>(*length, size));
  *length = size;
}

}  // namespace

std::string PeerNameOf(int connection, const sockaddr_storage& address, uint64_t number) {
  const auto& ipv4 = reinterpret_cast<const sockaddr_in&>(address);
  const auto& ipv6 = reinterpret_cast<const sockaddr_in6&>(address);
  // The port has the same place in the addresses of both families.
  const int port = ntohs(ipv4.sin_port);
  switch (address.ss_family) {
    case AF_INET:
      return absl::StrCat("ipv4:", TextOf(AF_INET, &ipv4.sin_addr), ":", port);
    case AF_INET6:
      if (IN6_IS_ADDR_V4MAPPED(&ipv6.sin6_addr)) {
        const auto* last = &ipv6.sin6_addr.s6_addr[12];
        return absl::StrCat("ipv4:", TextOf(AF_INET, last), ":", port);
      }
      return absl::StrCat("ipv6:%5B", TextOf(AF_INET6, &ipv6.sin6_addr), "%5D:", port);
    default:
      return absl::StrCat("unix:pid-", ProcessBehind(connection), "/", number);
  }
}

std::string ProcessOfPeer(const std::string& peer) {
  const bool is_known =
      absl::StartsWith(peer, "unix:pid-") && !absl::StartsWith(peer, "unix:pid-0/");
  return is_known ? peer.substr(0, peer.find('/')) : peer;
}

NamedPeer::NamedPeer(const std::string& peer) {
  absl::string_view path = peer;
  if (!absl::ConsumePrefix(&path, "unix:")) return;
  path_ = std::string(path);
  named_path = &path_;
}

NamedPeer::~NamedPeer() { named_path = nullptr; }

}  // namespace carillon

/// Replaces the C library's getpeername for the whole process.
extern "C" __attribute__((visibility("default"))) int CarillonGetPeerName(
    int connection, sockaddr* __restrict address, socklen_t* __restrict length) noexcept
    __asm__("getpeername");

extern "C" int CarillonGetPeerName(int connection, sockaddr* __restrict address,
                                   socklen_t* __restrict length) noexcept {
  if (carillon::named_path != nullptr) {
    carillon::WritePath(*carillon::named_path, address, length);
    return 0;
  }
  return static_cast<int>(syscall(SYS_getpeername, connection, address, length));
}
