// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "carillon/client.h"
#include "proto/cpp/server_address.h"

namespace carillon::cli {

/// The state that all commands share: the address of the daemon, the form of the output, and the
/// command that the command line chose.
struct Program {
  std::string server = ReachableServerAddress();
  std::string tls_roots_file;
  std::string admin_token;
  bool json = false;
  std::function<absl::Status()> command;

  std::unique_ptr<client::Client> Daemon() const {
    return client::Connect(server, {.tls_roots_pem = TlsRoots(), .admin_token = admin_token});
  }

 private:
  /// Returns the certificates of the file; none for a Unix socket, which has no TLS.
  std::string TlsRoots() const {
    if (server.rfind("unix:", 0) == 0) return "";
    std::ifstream file(tls_roots_file, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
};

}  // namespace carillon::cli
