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

/// The state of one scene's lease.
struct LeaseState {
  bool keep = false;                  ///< whether the scene lasts until somebody deletes it
  size_t connection_count = 0;        ///< open connections that have used the scene
  std::optional<double> ends_in_s{};  ///< set while no such connection is open
};

/// Decides how long scenes last. A scene ends when every connection that has used it is closed, and
/// a grace period in which a client may come back has passed. Safe from every thread.
class SceneLeases {
 public:
  /// Returns whether a connection is open.
  using IsOpen = std::function<bool(const std::string& connection)>;

  /// `clock` must outlive this.
  SceneLeases(const Clock& clock, std::chrono::nanoseconds grace, IsOpen is_open)
      : clock_(clock), grace_(grace), is_open_(std::move(is_open)) {}

  /// Adds a new scene, which a call on `connection` made. With `keep` the scene never ends by
  /// itself.
  void Begin(uint64_t scene, const std::string& connection, bool keep);

  /// Notes that a call on `connection` uses the scene.
  void Use(uint64_t scene, const std::string& connection);

  void End(uint64_t scene);

  /// Drops closed connections, and returns the scenes whose grace period is over.
  std::vector<uint64_t> Expired();

  /// Returns, among the scenes for which `among` is true, the scene that has had no open connection
  /// for the longest time. It is in its grace period.
  std::optional<uint64_t> LongestAbandoned(const std::function<bool(uint64_t scene)>& among);

  LeaseState StateOf(uint64_t scene);

 private:
  struct Lease {
    bool keep = false;
    std::set<std::string> connections{};
    std::optional<std::chrono::nanoseconds>
        abandoned{};  ///< time since which the scene has no open connection
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
