// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/access/access_control.h"

#include <grpc/grpc_security_constants.h>

#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/edge/access/call_name.h"
#include "server/api/edge/access/peer_name.h"

namespace carillon {
namespace {

constexpr unsigned kEveryRole = ~0U;

std::vector<std::string> Values(const grpc::AuthContext& identity, const char* property) {
  std::vector<std::string> values;
  for (const grpc::string_ref& value : identity.FindPropertyValues(property)) {
    values.emplace_back(value.data(), value.size());
  }
  return values;
}

/// Returns the DNS names of the client's certificate, or its common name if it has no alternative
/// name of any kind. E-mail addresses, URIs and IP addresses are not names of callers, because an
/// authority may let its users choose them. gRPC shows a certificate only if an authority of
/// --tls-client-roots vouches for it.
std::vector<std::string> CertificateNames(const grpc::CallbackServerContext& context) {
  const auto identity = context.auth_context();
  if (!identity) return {};
  const bool has_alternative = !Values(*identity, GRPC_X509_SAN_PROPERTY_NAME).empty();
  return Values(*identity,
                has_alternative ? GRPC_PEER_DNS_PROPERTY_NAME : GRPC_X509_CN_PROPERTY_NAME);
}

absl::Status WrongToken() {
  return Refusal(absl::StatusCode::kUnauthenticated, "TOKEN_WRONG",
                 "the daemon's access file has no such token: ask its administrator for one");
}

absl::Status TooManyFailures() {
  return Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_FAILURES",
                 "too many wrong tokens came from this address: try again in some seconds");
}

absl::Status MissingRole(const Principal& principal, Role role, bool is_anybody) {
  const std::string needed = role == Role::kAny
                                 ? "This call is for callers that the daemon knows"
                                 : absl::StrCat("This call needs the role ", RoleName(role));
  if (is_anybody) {
    return Refusal(absl::StatusCode::kUnauthenticated, "CREDENTIAL_MISSING",
                   absl::StrCat(needed,
                                ": show a token (\"authorization: Bearer TOKEN\" in the metadata, "
                                "CARILLON_TOKEN) or a client certificate that the daemon's access "
                                "file names, or come through the daemon's Unix socket"));
  }
  return Refusal(absl::StatusCode::kPermissionDenied, "ROLE_MISSING",
                 absl::StrCat(needed, ", which ", principal.name,
                              " has not: ask the daemon's administrator to add it to the access "
                              "file"));
}

/// Returns the token in the metadata "authorization: Bearer TOKEN", or an empty string.
std::string BearerToken(const grpc::CallbackServerContext& context) {
  const auto shown = context.client_metadata().find("authorization");
  if (shown == context.client_metadata().end()) return "";
  const absl::string_view value(shown->second.data(), shown->second.size());
  constexpr absl::string_view kScheme = "Bearer ";  // RFC 9110, 11.1: in letters of either case
  if (!absl::StartsWithIgnoreCase(value, kScheme)) return "";
  return std::string(value.substr(kScheme.size()));
}

}  // namespace

AccessControl::AccessControl(AccessTable table, const Clock& clock, LimitedLog::Sink log)
    : table_(std::make_shared<const AccessTable>(std::move(table))),
      guesses_(clock),
      log_(clock, "refused access", std::move(log)) {}

void AccessControl::Replace(AccessTable table) {
  auto replacement = std::make_shared<const AccessTable>(std::move(table));
  const MutexLock lock(&mutex_);
  table_ = std::move(replacement);
}

std::shared_ptr<const AccessTable> AccessControl::table() const {
  const MutexLock lock(&mutex_);
  return table_;
}

absl::StatusOr<Principal> AccessControl::Admit(const grpc::CallbackServerContext& context,
                                               Role role, const char* function) {
  absl::StatusOr<Principal> principal = Identify(context);
  if (!principal.ok()) return Refuse(context, function, principal.status());
  principal->function = function;
  principal->connection = context.peer();
  principal->client = ClientOf(*principal);
  if (principal->has(role)) return principal;
  const bool is_anybody = principal->name == table()->anybody().name;
  return Refuse(context, function, MissingRole(*principal, role, is_anybody));
}

absl::StatusOr<Principal> AccessControl::Identify(const grpc::CallbackServerContext& context) {
  const std::string peer = context.peer();
  if (absl::StartsWith(peer, "unix:")) return Principal{.name = kLocalCaller, .roles = kEveryRole};
  const std::shared_ptr<const AccessTable> table = this->table();
  const Principal* found = nullptr;
  if (const std::string token = BearerToken(context); !token.empty()) {
    found = table->FindToken(token);
    if (found == nullptr) return guesses_.TakeWrong(peer) ? WrongToken() : TooManyFailures();
    if (!guesses_.TakeRight(peer, found->name)) return TooManyFailures();
    return *found;
  }
  found = table->FindCertificate(CertificateNames(context));
  return found == nullptr ? table->anybody() : *found;
}

std::string AccessControl::ClientOf(const Principal& caller) const {
  if (absl::StartsWith(caller.connection, "unix:")) return ProcessOfPeer(caller.connection);
  if (caller.name == table()->anybody().name) return AddressOfPeer(caller.connection);
  return caller.name;
}

absl::Status AccessControl::Refuse(const grpc::CallbackServerContext& context, const char* function,
                                   absl::Status status) {
  log_.Warn(absl::StrCat("a call of ", CallName(function), " from ", context.peer(),
                         " was refused: ", status.message()));
  return status;
}

}  // namespace carillon
