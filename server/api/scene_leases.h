// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"

namespace carillon {

/// The state of the lease of one scene.
struct LeaseState {
  bool keep = false;                  ///< the scene lasts until somebody deletes it
  size_t connection_count = 0;        ///< open connections that have used the scene
  std::optional<double> ends_in_s{};  ///< set while no such connection is open
};

/// How long scenes last: until every connection that has used the scene was closed, and a time of
/// grace has passed in which a client may come back. Safe from every thread.
class SceneLeases {
 public:
  /// Whether a connection is open.
  using IsOpen = std::function<bool(const std::string& connection)>;

  /// `clock` must outlive this.
  SceneLeases(const Clock& clock, std::chrono::nanoseconds grace, IsOpen is_open)
      : clock_(clock), grace_(grace), is_open_(std::move(is_open)) {}

  /// A new scene, made by a call on `connection`; with `keep` it never ends by itself.
  void Begin(uint64_t scene, const std::string& connection, bool keep);

  /// A call on `connection` uses the scene.
  void Use(uint64_t scene, const std::string& connection);

  void End(uint64_t scene);

  /// Looks which connections were closed, and returns the scenes whose grace is over.
  std::vector<uint64_t> Expired();

  /// The scene, of those for which `among` is true, that nobody has used for the longest time and
  /// no open connection holds; it is in its grace.
  std::optional<uint64_t> LongestAbandoned(const std::function<bool(uint64_t scene)>& among);

  LeaseState StateOf(uint64_t scene);

 private:
  struct Lease {
    bool keep = false;
    std::set<std::string> connections{};
    std::optional<std::chrono::nanoseconds> abandoned{};  ///< since this time
  };

  /// Drops the connections that were closed.
  void Update(Lease& lease) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Clock& clock_;
  const std::chrono::nanoseconds grace_;
  const IsOpen is_open_;
  Mutex mutex_;
  std::map<uint64_t, Lease> leases_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
