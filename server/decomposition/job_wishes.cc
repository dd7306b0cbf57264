// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job_wishes.h"

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {

void JobWishes::Add(const std::string& client) {
  if (!client.empty()) clients_[client] = true;
}

void JobWishes::Add(const JobWishes& other) {
  for (const auto& [client, wants] : other.clients_) {
    if (wants) Add(client);
  }
}

absl::Status JobWishes::CheckCancel(const std::string& digest, const std::string& client) const {
  if (clients_.empty() || clients_.contains(client)) return absl::OkStatus();
  return Refusal(absl::StatusCode::kPermissionDenied, "JOB_OF_ANOTHER",
                 absl::StrCat("jobs/", digest,
                              " was asked for by other clients, and this client has not asked for "
                              "it: let them cancel it, or a caller with the role administer"));
}

std::string JobWishes::OtherThan(const std::string& client) const {
  for (const auto& [other, wants] : clients_) {
    if (wants && other != client) return other;
  }
  return "";
}

}  // namespace carillon
