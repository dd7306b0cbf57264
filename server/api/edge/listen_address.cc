// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/listen_address.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

absl::Status InvalidAddress(absl::string_view text) {
  return Refusal(
      absl::StatusCode::kInvalidArgument, "INVALID_CONFIGURATION",
      absl::StrCat("\"", text,
                   "\" is not an address; write unix:PATH, HOST:PORT or [HOST]:PORT, with a "
                   "path of at most 107 bytes"));
}

absl::StatusOr<ListenAddress> ParseTcp(absl::string_view text) {
  const size_t colon = text.rfind(':');
  if (colon == absl::string_view::npos) return InvalidAddress(text);
  absl::string_view host = text.substr(0, colon);
  ListenAddress address;
  const bool has_port = absl::SimpleAtoi(text.substr(colon + 1), &address.port);
  const bool bracketed = absl::ConsumePrefix(&host, "[") && absl::ConsumeSuffix(&host, "]");
  const bool has_host = !host.empty() && (bracketed || !absl::StrContains(host, ':'));
  if (!has_port || address.port < 0 || address.port > 65535 || !has_host) {
    return InvalidAddress(text);
  }
  address.host = std::string(host);
  return address;
}

/// Returns whether a server answers at the socket.
bool IsServed(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
  const int probe = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const bool served =
      connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  close(probe);
  return served;
}

/// Returns the mode for a socket in a folder.
absl::StatusOr<mode_t> SocketMode(const std::filesystem::path& folder) {
  struct stat status {};
  if (stat(folder.c_str(), &status) != 0) {
    return Refusal(absl::StatusCode::kFailedPrecondition, "LISTEN_FAILED",
                   absl::StrCat("cannot read the folder \"", folder.string(),
                                "\": ", std::generic_category().message(errno)));
  }
  const bool own = status.st_uid == geteuid() || status.st_uid == 0;
  const bool replaceable = (status.st_mode & 0022U) != 0 && (status.st_mode & S_ISVTX) == 0;
  if (own && !replaceable) return (status.st_mode & 0017U) == 0010U ? 0660 : 0600;
  return Refusal(absl::StatusCode::kFailedPrecondition, "LISTEN_FAILED",
                 absl::StrCat("other users could put a socket of theirs into \"", folder.string(),
                              own ? "\", which they may write to" : "\", which one of them owns",
                              ": name a folder of your own with --listen unix:PATH, or remove this "
                              "one"));
}

/// Refuses a path at which something else than a socket lies.
absl::Status CheckIsSocket(const std::string& path) {
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0 || S_ISSOCK(status.st_mode)) return absl::OkStatus();
  return Refusal(
      absl::StatusCode::kFailedPrecondition, "LISTEN_FAILED",
      absl::StrCat("\"", path, "\" is ",
                   S_ISDIR(status.st_mode) ? "a folder" : "a file of another kind",
                   ", not a socket, and stays as it is: choose another name with --listen"));
}

}  // namespace

bool ListenAddress::is_local() const {
  return is_unix() || host == "localhost" || host == "::1" || absl::StartsWith(host, "127.");
}

std::string ListenAddress::ToString() const {
  if (is_unix()) return absl::StrCat("unix:", socket_path);
  const bool bracket = absl::StrContains(host, ':');
  return bracket ? absl::StrCat("[", host, "]:", port) : absl::StrCat(host, ":", port);
}

absl::StatusOr<ListenAddress> ParseListenAddress(absl::string_view text) {
  absl::string_view path = text;
  if (!absl::ConsumePrefix(&path, "unix:")) return ParseTcp(text);
  absl::ConsumePrefix(&path, "//");
  if (path.empty() || path.size() >= sizeof(sockaddr_un::sun_path)) return InvalidAddress(text);
  // A client of gRPC reads the path as that of a URI, or as a list of paths.
  const size_t unreachable = path.find_first_of(",%?#");
  if (unreachable != absl::string_view::npos) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_CONFIGURATION",
                   absl::StrCat("no client could reach \"", text, "\", because its path has \"",
                                path.substr(unreachable, 1),
                                "\"; choose a path without the characters , % ? and #"));
  }
  ListenAddress address;
  address.socket_path = std::string(path);
  return address;
}

absl::Status CheckSocket(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
  std::error_code ignored;
  // PrepareSocket makes a folder that is missing.
  if (std::filesystem::exists(folder, ignored)) RETURN_IF_ERROR(SocketMode(folder).status());
  return CheckIsSocket(path);
}

absl::StatusOr<mode_t> PrepareSocket(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
  std::error_code error;
  std::filesystem::create_directories(folder.parent_path(), error);
  if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) {
    return Refusal(absl::StatusCode::kFailedPrecondition, "LISTEN_FAILED",
                   absl::StrCat("cannot make the folder \"", folder.string(),
                                "\": ", std::generic_category().message(errno)));
  }
  ASSIGN_OR_RETURN(const mode_t mode, SocketMode(folder));
  if (IsServed(path)) {
    return Refusal(absl::StatusCode::kFailedPrecondition, "LISTEN_FAILED",
                   absl::StrCat("a daemon serves unix:", path,
                                " already; stop it or choose another --listen"));
  }
  RETURN_IF_ERROR(CheckIsSocket(path));
  std::filesystem::remove(path, error);  // a daemon that was killed leaves its socket
  return mode;
}

}  // namespace carillon
