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
  std::string tls_certificate_file;
  std::string tls_key_file;
  std::string token;
  std::string token_file;
  bool json = false;
  std::function<absl::Status()> command;

  std::unique_ptr<client::Client> Daemon() const { return client::Connect(server, Connection()); }

  client::ConnectOptions Connection() const {
    return {.tls_roots_pem = ForTls(tls_roots_file),
            .tls_certificate_pem = ForTls(tls_certificate_file),
            .tls_key_pem = ForTls(tls_key_file),
            .token = Token()};
  }

 private:
  /// Returns the content of the file. Returns nothing for a Unix socket, which has no TLS.
  std::string ForTls(const std::string& path) const {
    if (server.rfind("unix:", 0) == 0) return "";
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  /// Returns the first line of the token's file if such a file is named, otherwise the token.
  std::string Token() const {
    if (token_file.empty()) return token;
    std::ifstream file(token_file);
    std::string line;
    std::getline(file, line);
    return line;
  }
};

}  // namespace carillon::cli
