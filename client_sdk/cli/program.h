// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <functional>
#include <iterator>
#include <string>

#include "absl/status/status.h"
#include "carillon/client.h"
#include "proto/cpp/server_address.h"

namespace carillon::cli {

/// What all commands share: where the daemon is, how to print, and the one command that the command
/// line chose.
struct Program {
  std::string server = DefaultServerAddress();
  std::string tls_roots_file;
  std::string admin_token;
  bool json = false;
  std::function<absl::Status()> command;

  client::Client Daemon() const {
    client::Client daemon(server, TlsRoots());
    daemon.SetAdminToken(admin_token);
    return daemon;
  }

 private:
  /// A Unix socket has no TLS.
  std::string TlsRoots() const {
    if (server.rfind("unix:", 0) == 0) return "";
    std::ifstream file(tls_roots_file, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
};

}  // namespace carillon::cli
