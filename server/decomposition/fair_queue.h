// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "absl/strings/string_view.h"

namespace carillon {

/// The order in which waiting jobs start. Clients take turns: the next job is the first of the
/// client whose newest start is the longest ago, whatever the priorities of the others' jobs. A
/// client's own jobs start by priority, highest first, then by number. Only one thread at a time
/// may use an object.
class FairQueue {
 public:
  struct Entry {
    std::string client{};
    int32_t priority = 0;
    uint64_t number = 0;
    std::string digest{};
  };

  void Add(const Entry& entry);
  /// Removes an entry, which may be absent.
  void Remove(const Entry& entry);

  bool empty() const { return queues_.empty(); }
  size_t size() const;
  /// Returns the number of a client's entries.
  size_t size(const std::string& client) const;

  /// Returns the digest of the job that is to start next, or nothing if no job waits.
  std::optional<std::string> Next() const;

  /// Returns the digests of all jobs in the order in which the jobs start if no other jobs are
  /// added. The result is valid until the next call that adds or removes an entry.
  std::vector<absl::string_view> Order() const;

  /// Records that a job of the client starts, so that the turn passes to the others.
  void NoteStart(const std::string& client);

 private:
  using Place = std::tuple<int32_t, uint64_t, std::string>;

  static Place PlaceOf(const Entry& entry);
  uint64_t NewestStart(const std::string& client) const;

  std::map<std::string, std::set<Place>> queues_;  ///< by client; none is empty
  /// Number of each client's newest start. The clients that started longest ago are forgotten.
  std::map<std::string, uint64_t> starts_;
  uint64_t start_count_ = 0;
};

}  // namespace carillon
