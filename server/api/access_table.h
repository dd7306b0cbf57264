// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace carillon {

/// The rights that a caller can have. docs/operations.md lists the calls of each role.
enum class Role : unsigned {
  kAny = 0,  ///< any role of the others will do
  kListen = 1,
  kStrike = 2,
  kSubmit = 4,
  kAdminister = 8,
};

/// The name of the role in files and messages.
absl::string_view RoleName(Role role);

/// A caller whom the daemon knows.
struct Principal {
  std::string name;
  unsigned roles = 0;        ///< bits of Role
  std::string connection{};  ///< of this call, as gRPC names its peer
  /// Whose share of scenes, streams and jobs it uses: the caller, if it has shown a credential;
  /// else the process behind a Unix socket, a connection over TCP, or, where the network reaches
  /// the daemon, the address that it comes from.
  std::string client{};

  bool has(Role role) const {
    return role == Role::kAny ? roles != 0 : (roles & static_cast<unsigned>(role)) != 0;
  }
};

/// The name of every caller that comes through the Unix socket.
inline constexpr char kLocalCaller[] = "local";

/// The callers that come over TCP, by the tokens and certificates that they show. It keeps only the
/// SHA-256 of tokens.
class AccessTable {
 public:
  /// The table of a daemon without a file: anybody may do all but administer, as the caller
  /// kLocalCaller, so that scenes made over TCP and over the Unix socket are open to both.
  static AccessTable ForThisMachine();

  /// Reads lines of the form "NAME ROLES CREDENTIAL". ROLES are separated by commas; CREDENTIAL is
  /// "sha256:" with the digest of a token, or "certificate:" with a name in a client's certificate.
  /// The name "anybody", without a credential, stands for callers that show neither. Lines that
  /// begin with # are left out. Errors: FailedPrecondition (ACCESS_FILE_UNUSABLE: the file cannot
  /// be read, others may read or change it, or a line is wrong).
  static absl::StatusOr<AccessTable> Read(const std::string& path);

  /// Null: no caller has this token.
  const Principal* FindToken(const std::string& token) const;

  /// Null: no caller has one of these names in its certificate.
  const Principal* FindCertificate(const std::vector<std::string>& names) const;

  /// The rights of callers that show nothing.
  const Principal& anybody() const { return anybody_; }

 private:
  struct Entry {
    Principal principal;
    std::string token_sha256{};      ///< empty: none
    std::string certificate_name{};  ///< empty: none
  };

  absl::Status ReadLine(absl::string_view line);

  std::vector<Entry> entries_;
  Principal anybody_{.name = "anybody"};
};

}  // namespace carillon
