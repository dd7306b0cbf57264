// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace carillon {

/// The clients that have asked for a job, and which of them still want it. Those that wanted it no
/// more when the daemon started are not known.
class JobWishes {
 public:
  JobWishes() = default;
  explicit JobWishes(const std::vector<std::string>& clients);

  /// Notes that a client wants the job. A client without a name is not noted.
  void Add(const std::string& client);

  /// Adds the clients that want another job.
  void Add(const JobWishes& other);

  /// Returns the clients that want the job.
  std::vector<std::string> Wanting() const;

  bool IsWantedBy(const std::string& client) const;

  /// Checks that the client may cancel the job, because it has asked for the job. Errors:
  /// PermissionDenied (JOB_OF_ANOTHER).
  absl::Status CheckCancel(const std::string& digest, const std::string& client) const;

  /// Returns a client other than `client` that wants the job, or an empty string if there is none.
  std::string OtherThan(const std::string& client) const;

  /// Notes that a client that has asked for the job does not want it any more.
  void Withdraw(const std::string& client) { clients_[client] = false; }

  /// Forgets all clients.
  void Clear() { clients_.clear(); }

 private:
  std::map<std::string, bool> clients_;  ///< whether each client still wants the job
};

}  // namespace carillon
