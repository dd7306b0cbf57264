// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace carillon {

/// The rights that a caller can have. docs/limits_and_access.md lists the calls of each role.
enum class Role : unsigned {
  kAny = 0,  ///< satisfied by any other role
  kListen = 1,
  kStrike = 2,
  kSubmit = 4,
  kAdminister = 8,
};

/// Returns the name of the role in files and messages.
absl::string_view RoleName(Role role);

/// A caller whom the daemon knows.
struct Principal {
  std::string name;
  unsigned roles = 0;        ///< bits of Role
  std::string connection{};  ///< connection of this call, as gRPC names its peer
  /// The client whose share of scenes, streams and jobs the call uses. It is the caller, if the
  /// caller has shown a credential. Otherwise it is the process behind a Unix socket, or the
  /// caller's address over TCP (AddressOfPeer).
  std::string client{};
  const char* function = "";  ///< the function that serves the call (CallName)

  bool has(Role role) const {
    return role == Role::kAny ? roles != 0 : (roles & static_cast<unsigned>(role)) != 0;
  }
};

/// The name of every caller that comes through the Unix socket.
inline constexpr char kLocalCaller[] = "local";

/// The callers that come over TCP, by the tokens and certificates that they show. The table keeps
/// only the SHA-256 of tokens.
class AccessTable {
 public:
  /// Returns the table of a daemon without an access file. Everybody is the caller kLocalCaller,
  /// who may do everything except administer. Scenes made over TCP and over the Unix socket are
  /// therefore open to both.
  static AccessTable ForThisMachine();

  /// Reads lines of the form "NAME ROLES CREDENTIAL". ROLES are separated by commas; CREDENTIAL is
  /// "sha256:" with the digest of a token, or "certificate:" with a name in a client's certificate.
  /// The name "anybody", without a credential, stands for callers that show neither a token nor a
  /// certificate. A name may have several lines, with the same roles and one credential each. No
  /// two lines may have the same credential. Lines that begin with # are ignored. Errors:
  /// FailedPrecondition (ACCESS_FILE_UNUSABLE: the file cannot be read, others may read or change
  /// it, a line is wrong, or two lines contradict each other).
  static absl::StatusOr<AccessTable> Read(const std::string& path);

  /// Returns the caller with this token, or null.
  const Principal* FindToken(const std::string& token) const;

  /// Returns the caller with one of these names in its certificate, or null.
  const Principal* FindCertificate(const std::vector<std::string>& names) const;

  /// Returns the rights of callers without a credential.
  const Principal& anybody() const { return anybody_; }

 private:
  struct Entry {
    Principal principal;
    std::string token_sha256{};      ///< empty if the caller has no token
    std::string certificate_name{};  ///< empty if it has no certificate
  };

  /// The lines that were read before a line, which must not contradict them.
  struct EarlierLines {
    std::map<std::string, int> by_credential;                 ///< number of the line
    std::map<std::string, std::pair<unsigned, int>> by_name;  ///< roles, number of the first line
    /// Remembers a line. Returns an error if the line contradicts an earlier one.
    absl::Status Check(const std::string& name, unsigned roles, const std::string& credential,
                       int number);
  };

  absl::Status ReadLine(absl::string_view line, int number, EarlierLines& earlier);

  std::vector<Entry> entries_;
  Principal anybody_{.name = "anybody"};
};

}  // namespace carillon
