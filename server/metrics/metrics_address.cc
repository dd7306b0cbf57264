// SPDX-License-Identifier: Apache-2.0
#include "server/metrics/metrics_address.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

absl::Status CannotServe(const std::string& address, absl::string_view why) {
  return Refusal(
      absl::StatusCode::kFailedPrecondition, "LISTEN_FAILED",
      absl::StrCat("cannot serve metrics on ", address, ": ", why,
                   "; let --metrics name a free port at an IPv4 address of this machine, "
                   "such as 127.0.0.1:9464"));
}

absl::StatusOr<sockaddr_in> Resolve(const std::string& address) {
  const size_t colon = address.rfind(':');
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(address.substr(0, colon).c_str(), address.substr(colon + 1).c_str(),
                                &hints, &found);
  if (error != 0) {
    const std::string why =
        error == EAI_SYSTEM ? std::generic_category().message(errno) : gai_strerror(error);
    return CannotServe(address, why);
  }
  const absl::Cleanup free_found = [found] { freeaddrinfo(found); };
  return *reinterpret_cast<const sockaddr_in*>(found->ai_addr);
}

/// Returns 0, or the error of the system.
int TryToBind(const sockaddr_in& address) {
  const int made = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (made < 0) return errno;
  const absl::Cleanup close_made = [made] { close(made); };
  const int yes = 1;
  setsockopt(made, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  return bind(made, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ? 0 : errno;
}

absl::Status CannotBind(const std::string& address, int error) {
  return CannotServe(address, std::generic_category().message(error));
}

}  // namespace

absl::StatusOr<std::string> FindMetricsAddress(const std::string& address) {
  ASSIGN_OR_RETURN(const sockaddr_in resolved, Resolve(address));
  if (const int error = TryToBind(resolved); error != 0) return CannotBind(address, error);
  std::array<char, INET_ADDRSTRLEN> text;
  inet_ntop(AF_INET, &resolved.sin_addr, text.data(), text.size());
  return absl::StrCat(text.data(), ":", ntohs(resolved.sin_port));
}

absl::Status CheckMetricsAddress(const std::string& address) {
  ASSIGN_OR_RETURN(const sockaddr_in resolved, Resolve(address));
  const int error = TryToBind(resolved);
  return error == 0 || error == EADDRINUSE ? absl::OkStatus() : CannotBind(address, error);
}

}  // namespace carillon
