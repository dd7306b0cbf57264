// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/connection_gate.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <system_error>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/edge/client_limits.h"
#include "server/api/edge/guess_limiter.h"
#include "server/api/edge/peer_name.h"

namespace carillon {
namespace {

constexpr size_t kMaxConnectionCount = 4096;
/// Descriptors that the database, decompositions and devices may need, apart from the connections.
constexpr size_t kOwnDescriptorCount = 256;
constexpr int kBacklog = 1024;
/// This part of the places is for processes and addresses with few connections.
constexpr size_t kKeptPart = 16;
/// This part of the places is for the Unix sockets.
constexpr size_t kUnixPart = 64;
/// After the gate has looked which connections are closed, it pauses this many times as long, so
/// that a flood of connections beyond a limit takes a small part of its time.
constexpr int kForgettingPauses = 8;
/// Pause after an accept that failed for lack of descriptors or memory.
constexpr std::chrono::milliseconds kPause(50);
/// Time between two looks at the socket files.
constexpr std::chrono::milliseconds kLookPeriod(1000);

absl::Status Failed(const ListenAddress& address, int error) {
  const bool in_use = error == EADDRINUSE;
  return Refusal(absl::StatusCode::kFailedPrecondition, in_use ? "ADDRESS_IN_USE" : "LISTEN_FAILED",
                 absl::StrCat("cannot listen on ", address.ToString(), ": ",
                              std::generic_category().message(error), "; choose another --listen"));
}

/// Returns a socket that listens at an address, or -1 with errno.
int Bind(const sockaddr* address, socklen_t size) {
  const int made = socket(address->sa_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (made < 0) return -1;
  const int yes = 1;
  const int no = 0;
  if (address->sa_family == AF_INET6) {
    setsockopt(made, IPPROTO_IPV6, IPV6_V6ONLY, &no, sizeof no);
  }
  if (address->sa_family == AF_UNIX) {
    fchmod(made, 0600);  // no other user can connect before the mode is decided
  } else {
    setsockopt(made, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    // Accepted connections inherit this option.
    setsockopt(made, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  }
  if (bind(made, address, size) == 0 && listen(made, kBacklog) == 0) return made;
  const int error = errno;
  close(made);
  errno = error;
  return -1;
}

int PortOf(int bound) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  getsockname(bound, reinterpret_cast<sockaddr*>(&address), &size);
  // The port has the same place in the addresses of both families.
  return ntohs(reinterpret_cast<const sockaddr_in*>(&address)->sin_port);
}

/// Discards what a connection has received and nobody has read yet. TCP holds up to 6 MiB, in which
/// gRPC would still find tens of thousands of calls.
void DiscardReceived(int connection) {
  std::array<char, size_t{64} << 10U> discarded;
  while (recv(connection, discarded.data(), discarded.size(), MSG_DONTWAIT) > 0) {
  }
}

std::chrono::steady_clock::time_point Now() { return std::chrono::steady_clock::now(); }

/// Returns the inode of a descriptor, or 0 if the descriptor is closed.
ino_t InodeOf(int descriptor) {
  struct stat status {};
  return fstat(descriptor, &status) == 0 ? status.st_ino : 0;
}

}  // namespace

std::string SourceOfPeer(const std::string& peer) {
  return absl::StartsWith(peer, "unix:") ? peer.substr(0, peer.rfind('/')) : AddressOfPeer(peer);
}

ConnectionGate::ConnectionGate(size_t max_connection_count, double client_share, LimitedLog* log,
                               SourceFunction& source_of)
    : max_connection_count_(max_connection_count),
      client_share_(client_share),
      log_(log),
      source_of_(source_of),
      stop_(eventfd(0, EFD_CLOEXEC)) {}

ConnectionGate::~ConnectionGate() {
  Close();
  close(stop_);
}

void ConnectionGate::Close() {
  eventfd_write(stop_, 1);
  if (thread_.joinable()) thread_.join();
  // Before the sockets are closed, their inodes belong to no other file.
  for (const WatchedFile& watched : socket_files_) watched.file.Remove();
  for (const Door& door : doors_) close(door.socket);
  doors_.clear();
  socket_files_.clear();
}

absl::Status ConnectionGate::Listen(ListenAddress& address,
                                    std::unique_ptr<ConnectionTaker> taker) {
  RETURN_IF_ERROR(address.is_unix() ? ListenUnix(address, *taker) : ListenTcp(address, *taker));
  takers_.push_back(std::move(taker));
  return absl::OkStatus();
}

absl::Status ConnectionGate::ListenUnix(const ListenAddress& address, ConnectionTaker& taker) {
  ASSIGN_OR_RETURN(const mode_t mode, PrepareSocket(address.socket_path));
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  std::strncpy(name.sun_path, address.socket_path.c_str(), sizeof(name.sun_path) - 1);
  const int bound = Bind(reinterpret_cast<const sockaddr*>(&name), sizeof name);
  if (bound < 0) return Failed(address, errno);
  doors_.push_back({bound, &taker});
  std::optional<SocketFile> file = SocketFile::Remember(address.socket_path);
  if (!file) return Failed(address, errno);
  socket_files_.push_back({.file = *std::move(file)});
  if (chmod(address.socket_path.c_str(), mode) != 0) return Failed(address, errno);
  return absl::OkStatus();
}

absl::Status ConnectionGate::ListenTcp(ListenAddress& address, ConnectionTaker& taker) {
  addrinfo hints{};
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(address.host.c_str(), "0", &hints, &found);
  if (error != 0) return Failed(address, error == EAI_SYSTEM ? errno : EADDRNOTAVAIL);
  const absl::Cleanup free_found = [found] { freeaddrinfo(found); };
  int last_error = EADDRNOTAVAIL;
  bool bound_any = false;
  for (addrinfo* each = found; each != nullptr; each = each->ai_next) {
    // The port has the same place in the addresses of both families.
    reinterpret_cast<sockaddr_in*>(each->ai_addr)->sin_port =
        htons(static_cast<uint16_t>(address.port));
    const int bound = Bind(each->ai_addr, each->ai_addrlen);
    if (bound < 0) {
      last_error = errno;
      continue;
    }
    doors_.push_back({bound, &taker});
    address.port = PortOf(bound);
    bound_any = true;
  }
  return bound_any ? absl::OkStatus() : Failed(address, last_error);
}

void ConnectionGate::Open() {
  thread_ = std::thread([this] { Run(); });
}

void ConnectionGate::Run() {
  std::vector<pollfd> awaited{{stop_, POLLIN, 0}};
  for (const Door& door : doors_) awaited.push_back({door.socket, POLLIN, 0});
  const auto period = socket_files_.empty() ? -1 : static_cast<int>(kLookPeriod.count());
  while (poll(awaited.data(), awaited.size(), period) < 0 || (awaited[0].revents & POLLIN) == 0) {
    for (size_t i = 0; i < doors_.size(); ++i) {
      if ((awaited[i + 1].revents & POLLIN) != 0) Accept(doors_[i]);
    }
    LookAtSocketFiles();
  }
}

void ConnectionGate::LookAtSocketFiles() {
  const auto now = Now();
  if (log_ == nullptr || now < next_look_) return;
  next_look_ = now + kLookPeriod;
  for (WatchedFile& watched : socket_files_) {
    const bool was_in_place = std::exchange(watched.was_in_place, watched.file.IsInPlace());
    if (!was_in_place || watched.was_in_place) continue;
    log_->Warn(absl::StrCat("somebody removed or replaced the socket ", watched.file.path(),
                            ", so that new clients do not find this daemon: put the file back, or "
                            "restart the daemon; open connections go on"));
  }
}

/// Accepts only one connection, so that no address waits for another.
void ConnectionGate::Accept(const Door& door) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  const int connection = accept4(door.socket, reinterpret_cast<sockaddr*>(&address), &size,
                                 SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (connection < 0) {
    const int error = errno;
    if (error == EAGAIN || error == ECONNABORTED || error == EINTR) return;
    WarnOnce("", absl::StrCat("cannot accept connections (", std::generic_category().message(error),
                              "), and new clients wait: raise the daemon's limit of descriptors "
                              "(ulimit -n; systemd's LimitNOFILE=), or end some of its clients"));
    std::this_thread::sleep_for(kPause);
    return;
  }
  const std::string peer = PeerNameOf(connection, address, ++accepted_count_);
  if (!Admit(peer, {.descriptor = connection, .inode = InodeOf(connection)})) {
    close(connection);
    return;
  }
  const NamedPeer named(peer);
  door.taker->Take(connection, source_of_(peer));
}

bool ConnectionGate::Connection::is_open() const { return InodeOf(descriptor) == inode; }

bool ConnectionGate::Admit(const std::string& peer, const Connection& connection) {
  const std::string source = source_of_(peer);
  std::string reason;
  {
    const MutexLock lock(&mutex_);
    const auto refused = refused_.find(source);
    if (refused != refused_.end() && Now() < refused->second) return false;
    reason = WhyNoPlace(source);
    // The memory of closed connections must not grow with the number of clients that ever came.
    const bool is_long = connections_.size() >= most_remembered_;
    if ((is_long || !reason.empty()) && ForgetClosed()) {
      reason = WhyNoPlace(source);
      most_remembered_ = 2 * connections_.size() + kFewConnections;
    }
    if (reason.empty() && connections_.insert_or_assign(peer, connection).second) ++counts_[source];
  }
  if (!reason.empty()) Tell(source, reason);
  return reason.empty();
}

bool ConnectionGate::ForgetClosed() {
  const auto began = Now();
  if (began < next_forgetting_) return false;
  std::erase_if(connections_, [](const auto& each) { return !each.second.is_open(); });
  counts_.clear();
  for (const auto& [peer, connection] : connections_) ++counts_[source_of_(peer)];
  const auto ended = Now();
  next_forgetting_ = ended + kForgettingPauses * (ended - began);
  return true;
}

std::string ConnectionGate::WhyNoPlace(const std::string& source) const {
  const size_t all = connections_.size();
  if (all >= max_connection_count_) return absl::StrCat("all ", all, " places are taken");
  const auto counted = counts_.find(source);
  const size_t count = counted == counts_.end() ? 0 : counted->second;
  const size_t most = ClientLimits::ShareOf(max_connection_count_, client_share_);
  if (client_share_ < 1 && count >= most) {
    return absl::StrCat("it has ", count, " already, its share (--client-share) of ",
                        max_connection_count_);
  }
  const size_t kept_for_unix = max_connection_count_ / kUnixPart;
  if (!absl::StartsWith(source, "unix:") && all >= max_connection_count_ - kept_for_unix) {
    return absl::StrCat("the last ", kept_for_unix, " of ", max_connection_count_,
                        " places are for the Unix socket");
  }
  const size_t kept = max_connection_count_ / kKeptPart;
  if (all < max_connection_count_ - kept || count < kFewConnections) return "";
  return absl::StrCat("it has ", count, " already, and the last ", kept, " of ",
                      max_connection_count_, " places are for clients with fewer than ",
                      kFewConnections);
}

void ConnectionGate::Tell(const std::string& source, const std::string& reason) {
  WarnOnce(source,
           absl::StrCat("closed a new connection from ", source, ": ", reason,
                        "; for 30 s further ones that reach a limit are closed without a line"));
}

void ConnectionGate::WarnOnce(const std::string& subject, const std::string& line) {
  if (log_ == nullptr) return;
  const auto now = Now();
  std::erase_if(told_, [now](const auto& each) { return each.second <= now; });
  if (told_.emplace(subject, now + kRefusal).second) log_->Warn(line);
}

bool ConnectionGate::IsOpen(const std::string& peer) const {
  const MutexLock lock(&mutex_);
  const auto found = connections_.find(peer);
  return found != connections_.end() && found->second.is_open();
}

bool ConnectionGate::Refuse(const std::string& peer) {
  const MutexLock lock(&mutex_);
  if (!EndLocked(peer)) return false;
  RefuseSourceLocked(peer);
  return true;
}

bool ConnectionGate::End(const std::string& peer) {
  const MutexLock lock(&mutex_);
  return EndLocked(peer);
}

bool ConnectionGate::EndLocked(const std::string& peer) {
  const auto found = connections_.find(peer);
  if (found == connections_.end() || found->second.refused || !found->second.is_open()) {
    return false;
  }
  found->second.refused = true;
  // gRPC, which owns the descriptor, then sees the end of the connection and closes the descriptor.
  shutdown(found->second.descriptor, SHUT_RDWR);
  DiscardReceived(found->second.descriptor);
  return true;
}

bool ConnectionGate::RefuseSource(const std::string& peer) {
  const MutexLock lock(&mutex_);
  return RefuseSourceLocked(peer);
}

bool ConnectionGate::RefuseSourceLocked(const std::string& peer) {
  const auto now = Now();
  std::erase_if(refused_, [now](const auto& each) { return each.second <= now; });
  return refused_.insert_or_assign(source_of_(peer), now + RefusalTimeOf(peer)).second;
}

std::optional<TcpBytes> ConnectionGate::CountBytes(const std::string& peer) const {
  const MutexLock lock(&mutex_);
  const auto found = connections_.find(peer);
  if (found == connections_.end() || !found->second.is_open()) return std::nullopt;
  return CountTcpBytes(found->second.descriptor);
}

std::chrono::seconds ConnectionGate::RefusalTimeOf(const std::string& peer) const {
  return source_of_(peer) == kLoopback ? kLoopbackRefusal : kRefusal;
}

size_t ConnectionGate::open_count() const {
  const MutexLock lock(&mutex_);
  return static_cast<size_t>(
      std::ranges::count_if(connections_, [](const auto& each) { return each.second.is_open(); }));
}

size_t RaiseConnectionLimit() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, kMaxConnectionCount + kOwnDescriptorCount);
  rlimit now{};
  getrlimit(RLIMIT_NOFILE, &now);
  if (now.rlim_cur < limit.rlim_cur && setrlimit(RLIMIT_NOFILE, &limit) == 0) now = limit;
  const size_t count = now.rlim_cur;
  if (count < 2 * kOwnDescriptorCount) return count / 2;
  return std::min(kMaxConnectionCount, count - kOwnDescriptorCount);
}

}  // namespace carillon
