// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/server_address.h"

#include <unistd.h>

#include <charconv>
#include <cstdlib>
#include <string_view>
#include <system_error>

namespace carillon {
namespace {

std::string_view Environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string_view() : std::string_view(value);
}

}  // namespace

std::string DefaultServerAddress() {
  if (const std::string_view server = Environment("CARILLON_SERVER"); !server.empty()) {
    return std::string(server);
  }
  const std::string_view runtime = Environment("XDG_RUNTIME_DIR");
  const std::string folder = runtime.empty() ? "/tmp/carillon-" + std::to_string(getuid())
                                             : std::string(runtime) + "/carillon";
  return "unix:" + folder + "/carillond.sock";
}

std::string ReachableServerAddress() {
  constexpr std::string_view kPrefix = "unix:";
  constexpr std::string_view kSystem = "unix:/run/carillon/carillond.sock";
  const auto exists = [&](std::string_view address) {
    return access(std::string(address.substr(kPrefix.size())).c_str(), F_OK) == 0;
  };
  const std::string own = DefaultServerAddress();
  const bool named = !Environment("CARILLON_SERVER").empty();
  return named || exists(own) || !exists(kSystem) ? own : std::string(kSystem);
}

bool IsServerAddress(const std::string& text) {
  constexpr int kMostPort = 65535;
  if (text.starts_with("unix:")) return text.size() > 5;
  const size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return false;
  int port = 0;
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data() + colon + 1, end, port);
  return read.ec == std::errc() && read.ptr == end && port >= 1 && port <= kMostPort;
}

bool IsOnThisMachine(const std::string& address) {
  for (const char* prefix : {"unix:", "localhost:", "[::1]:"}) {
    if (address.starts_with(prefix)) return true;
  }
  // A name such as 127.example.org may be that of any machine.
  return address.starts_with("127.") &&
         address.find_first_not_of("0123456789.:") == std::string::npos;
}

}  // namespace carillon
