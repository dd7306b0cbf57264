// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job_wishes.h"

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {

JobWishes::JobWishes(const std::vector<std::string>& clients) {
  for (const std::string& client : clients) Add(client);
}

void JobWishes::Add(const std::string& client) {
  if (!client.empty()) clients_[client] = true;
}

void JobWishes::Add(const JobWishes& other) {
  for (const std::string& client : other.Wanting()) Add(client);
}

std::vector<std::string> JobWishes::Wanting() const {
  std::vector<std::string> clients;
  for (const auto& [client, wants] : clients_) {
    if (wants) clients.push_back(client);
  }
  return clients;
}

bool JobWishes::IsWantedBy(const std::string& client) const {
  const auto found = clients_.find(client);
  return found != clients_.end() && found->second;
}

absl::Status JobWishes::CheckCancel(const std::string& digest, const std::string& client) const {
  if (clients_.contains(client)) return absl::OkStatus();
  return Refusal(absl::StatusCode::kPermissionDenied, "JOB_OF_ANOTHER",
                 absl::StrCat("this client has not asked for jobs/", digest,
                              ": let the clients that have asked for it cancel it, or a caller "
                              "with the role administer"));
}

std::string JobWishes::OtherThan(const std::string& client) const {
  for (const std::string& other : Wanting()) {
    if (other != client) return other;
  }
  return "";
}

}  // namespace carillon
