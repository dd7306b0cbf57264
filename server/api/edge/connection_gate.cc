// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/connection_gate.h"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
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
#include "server/api/edge/access/guess_limiter.h"
#include "server/api/edge/access/peer_name.h"
#include "server/api/edge/client_limits.h"

namespace carillon {
namespace {

constexpr size_t kMaxConnectionCount = 4096;
/// gRPC's descriptor and the gate's duplicate.
constexpr size_t kDescriptorsOfConnection = 2;
/// Descriptors that the database, decompositions and devices may need, apart from the connections.
constexpr size_t kOwnDescriptorCount = 256;
constexpr int kBacklog = 1024;
/// Pause after an accept that failed for lack of descriptors or memory.
constexpr std::chrono::milliseconds kPause(50);
constexpr size_t kEventsAtOnce = 64;

absl::Status Failed(const ListenAddress& address, int error) {
  return Refusal(absl::StatusCode::kFailedPrecondition, "LISTEN_FAILED",
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
      stop_(eventfd(0, EFD_CLOEXEC)),
      events_(epoll_create1(EPOLL_CLOEXEC)) {
  Await(stop_, EPOLLIN);
}

ConnectionGate::~ConnectionGate() {
  Close();
  for (const auto& [duplicate, peer] : peers_) close(duplicate);
  close(events_);
  close(stop_);
}

void ConnectionGate::Await(int descriptor, uint32_t events) const {
  epoll_event event{.events = events, .data = {.fd = descriptor}};
  epoll_ctl(events_, EPOLL_CTL_ADD, descriptor, &event);
}

void ConnectionGate::Close() {
  eventfd_write(stop_, 1);
  if (thread_.joinable()) thread_.join();
  // Before the sockets are closed, their inodes belong to no other file.
  for (const SocketFile& file : socket_files_) file.Remove();
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
  socket_files_.push_back(*std::move(file));
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

void ConnectionGate::Open(std::function<void()> on_first) {
  on_first_ = std::move(on_first);
  for (const Door& door : doors_) Await(door.socket, EPOLLIN);
  thread_ = std::thread([this] { Run(); });
}

void ConnectionGate::Run() {
  std::array<epoll_event, kEventsAtOnce> events{};
  for (;;) {
    const int count = epoll_wait(events_, events.data(), kEventsAtOnce, -1);
    const auto end = events.begin() + std::max(count, 0);
    std::vector<const Door*> ready;
    for (auto event = events.begin(); event != end; ++event) {
      if (event->data.fd == stop_) return;
      const auto door = std::ranges::find(doors_, event->data.fd, &Door::socket);
      if (door == doors_.end()) {
        Forget(event->data.fd);
      } else {
        ready.push_back(&*door);
      }
    }
    // Not before, because a new duplicate may get the number of one that has ended.
    for (const Door* door : ready) Accept(*door);
  }
}

/// Accepts only one connection, so that no address waits for another.
void ConnectionGate::Accept(const Door& door) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  const int connection = accept4(door.socket, reinterpret_cast<sockaddr*>(&address), &size,
                                 SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (connection < 0) return WaitForDescriptors(errno);
  const int duplicate = fcntl(connection, F_DUPFD_CLOEXEC, 0);
  if (duplicate < 0) {
    const int error = errno;
    close(connection);
    return WaitForDescriptors(error);
  }
  const std::string peer = PeerNameOf(connection, address, ++accepted_count_);
  const std::string source = source_of_(peer);
  const Entry entry = Admit(peer, source, duplicate);
  if (entry == Entry::kNone) {
    close(duplicate);
    close(connection);
    return;
  }
  Await(duplicate, EPOLLET);  // epoll always tells of the end, EPOLLHUP
  const NamedPeer named(peer);
  if (entry == Entry::kRefusal) return door.taker->Refuse(connection);
  door.taker->Take(connection, source);
}

void ConnectionGate::WaitForDescriptors(int error) {
  if (error == EAGAIN || error == ECONNABORTED || error == EINTR) return;
  WarnOnce("", absl::StrCat("cannot accept connections (", std::generic_category().message(error),
                            "), and new clients wait: raise the daemon's limit of descriptors "
                            "(ulimit -n; systemd's LimitNOFILE=), or end some of its clients"));
  std::this_thread::sleep_for(kPause);
}

ConnectionGate::Entry ConnectionGate::Admit(const std::string& peer, const std::string& source,
                                            int duplicate) {
  std::string refusal;
  Entry entry = Entry::kPlace;
  bool first = false;
  {
    const MutexLock lock(&mutex_);
    const auto refused = refused_.find(source);
    if (refused != refused_.end() && Now() < refused->second) return Entry::kNone;
    ForgetLocked(peer);  // an older connection that had the same port
    refusal = WhyNoPlace(source);
    if (!refusal.empty()) entry = refused_count_ < kMostRefused ? Entry::kRefusal : Entry::kNone;
    if (entry != Entry::kNone) {
      first = connections_.empty();
      connections_[peer] = {.descriptor = duplicate, .refusal = refusal};
      peers_[duplicate] = peer;
      ++(entry == Entry::kPlace ? counts_[source] : refused_count_);
    }
  }
  if (first) on_first_();
  if (!refusal.empty()) {
    WarnOnce(source, absl::StrCat("refused a new connection from ", source, ": ", refusal,
                                  "; for 30 s further ones are refused without a line"));
  }
  return entry;
}

void ConnectionGate::Forget(int duplicate) {
  const MutexLock lock(&mutex_);
  const auto peer = peers_.find(duplicate);
  if (peer != peers_.end()) ForgetLocked(std::string(peer->second));
}

void ConnectionGate::ForgetLocked(const std::string& peer) {
  const auto found = connections_.find(peer);
  if (found == connections_.end()) return;
  const int duplicate = found->second.descriptor;
  const bool has_place = found->second.refusal.empty();
  // gRPC may still hold its descriptor of the same connection.
  epoll_ctl(events_, EPOLL_CTL_DEL, duplicate, nullptr);
  close(duplicate);
  peers_.erase(duplicate);
  connections_.erase(found);
  if (!has_place) {
    --refused_count_;
    return;
  }
  const auto count = counts_.find(source_of_(peer));
  if (--count->second == 0) counts_.erase(count);
}

std::string ConnectionGate::WhyNoPlace(const std::string& source) const {
  const size_t all = connections_.size() - refused_count_;
  if (all >= max_connection_count_) return absl::StrCat("all ", all, " places are taken");
  const auto counted = counts_.find(source);
  const size_t count = counted == counts_.end() ? 0 : counted->second;
  const size_t most = ClientLimits::ShareOf(max_connection_count_, client_share_);
  if (client_share_ >= 1 || count < most) return "";
  return absl::StrCat("it has ", count, " already, its share (--client-share) of ",
                      max_connection_count_);
}

void ConnectionGate::WarnOnce(const std::string& subject, const std::string& line) {
  if (log_ == nullptr) return;
  const auto now = Now();
  std::erase_if(told_, [now](const auto& each) { return each.second <= now; });
  if (told_.emplace(subject, now + kRefusal).second) log_->Warn(line);
}

bool ConnectionGate::IsOpen(const std::string& peer) const {
  const MutexLock lock(&mutex_);
  return connections_.contains(peer);
}

std::string ConnectionGate::WhyRefused(const std::string& peer) const {
  const MutexLock lock(&mutex_);
  const auto found = connections_.find(peer);
  return found == connections_.end() ? "" : found->second.refusal;
}

bool ConnectionGate::End(const std::string& peer) {
  const MutexLock lock(&mutex_);
  const auto found = connections_.find(peer);
  if (found == connections_.end() || std::exchange(found->second.ending, true)) return false;
  // gRPC then sees the end of the connection, and closes its own descriptor.
  shutdown(found->second.descriptor, SHUT_RDWR);
  DiscardReceived(found->second.descriptor);
  return true;
}

bool ConnectionGate::Refuse(const std::string& source) {
  const MutexLock lock(&mutex_);
  const auto now = Now();
  std::erase_if(refused_, [now](const auto& each) { return each.second <= now; });
  return refused_.emplace(source, now + RefusalTimeOf(source)).second;
}

std::optional<TcpBytes> ConnectionGate::CountBytes(const std::string& peer) const {
  const MutexLock lock(&mutex_);
  const auto found = connections_.find(peer);
  if (found == connections_.end() || found->second.ending) return std::nullopt;
  return CountTcpBytes(found->second.descriptor);
}

std::chrono::seconds ConnectionGate::RefusalTimeOf(const std::string& source) {
  return source == kLoopback ? kLoopbackRefusal : kRefusal;
}

size_t ConnectionGate::open_count() const {
  const MutexLock lock(&mutex_);
  return connections_.size() - refused_count_;
}

size_t RaiseConnectionLimit() {
  constexpr size_t kMost = kDescriptorsOfConnection * kMaxConnectionCount + kOwnDescriptorCount;
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  rlimit raised = limit;
  raised.rlim_cur = std::min<rlim_t>(limit.rlim_max, kMost);
  if (limit.rlim_cur < raised.rlim_cur && setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
  const size_t count = std::min<size_t>(limit.rlim_cur, kMost);
  const size_t own = std::min(kOwnDescriptorCount, count / 2);
  return (count - own) / kDescriptorsOfConnection;
}

}  // namespace carillon
