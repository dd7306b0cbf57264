// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cpp/internal/rpc_status.h"

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "carillon/v1/error.pb.h"
#include "proto/cpp/error_reason.h"

namespace carillon::client {
namespace {

/// Says how to repair a connection that failed. gRPC reports mistakes of TLS only within its text.
std::string WhyUnavailable(const std::string& text, const std::string& server) {
  const std::string lower = absl::AsciiStrToLower(text);
  const bool tls = absl::StrContains(lower, "ssl") || absl::StrContains(lower, "certificate");
  const bool closed = absl::StrContains(text, "Socket closed") ||
                      absl::StrContains(text, "Connection reset") ||
                      absl::StrContains(text, "Broken pipe");
  if (tls) {
    return absl::StrCat("TLS with ", server, " failed (", text,
                        "); check that the daemon there has a TLS certificate for this address, "
                        "and that the roots given vouch for it");
  }
  if (absl::StrContains(text, "Permission denied") && absl::StartsWith(server, "unix:")) {
    return absl::StrCat("this user may not use ", server, " (", text,
                        "): for a daemon of the system, join the group carillon and log in again");
  }
  if (closed && !absl::StartsWith(server, "unix:")) {
    return absl::StrCat("the program at ", server, " closed the connection (", text,
                        "): it ended, and its log says why, or it is a daemon with TLS, for which "
                        "give the roots that vouch for it (--tls-roots)");
  }
  return absl::StrCat("no carillond answers at ", server, " (", text,
                      "); start it there, or name another address");
}

}  // namespace

absl::Status FromRpc(const grpc::Status& status, const std::string& server) {
  if (status.ok()) return absl::OkStatus();
  // gRPC's codes and absl's are the same numbers.
  const auto code = static_cast<absl::StatusCode>(status.error_code());
  v1::StatusDetails details;
  if (details.ParseFromString(status.error_details())) {
    for (const google::protobuf::Any& any : details.details()) {
      if (v1::ErrorInfo error; any.UnpackTo(&error)) return FromErrorInfo(code, error);
    }
  }
  if (code == absl::StatusCode::kUnavailable) {
    return Refusal(code, "SERVER_UNAVAILABLE", WhyUnavailable(status.error_message(), server));
  }
  // gRPC gives this text to a call with a token on a connection that is not encrypted.
  if (code == absl::StatusCode::kUnauthenticated &&
      absl::StrContains(status.error_message(), "sufficient security level")) {
    return Refusal(absl::StatusCode::kFailedPrecondition, "TLS_REQUIRED",
                   absl::StrCat("the network could read the token on its way to ", server,
                                ", so that it was not sent: give the roots that vouch for the "
                                "daemon's certificate (--tls-roots), or no token"));
  }
  if (code == absl::StatusCode::kDeadlineExceeded) {
    return Refusal(code, "SERVER_TIMEOUT",
                   absl::StrCat(server, " took too long to answer; try again later"));
  }
  if (code == absl::StatusCode::kResourceExhausted &&
      absl::StartsWith(status.error_message(), "Received message larger than max")) {
    return Refusal(code, "MESSAGE_TOO_LARGE",
                   absl::StrCat("the daemon at ", server,
                                " refuses the size of a message: ", status.error_message(),
                                "; report fewer points in a step, or ask for less in one "
                                "call"));
  }
  // gRPC ends a call so if the daemon cannot parse its request.
  if (code == absl::StatusCode::kUnimplemented && status.error_message().empty()) {
    return Refusal(code, "REQUEST_MALFORMED",
                   absl::StrCat("the daemon at ", server,
                                " cannot parse the request, or does not know the call: give text "
                                "in UTF-8, and use a daemon that is no older than the client"));
  }
  return absl::Status(code, status.error_message());
}

}  // namespace carillon::client
