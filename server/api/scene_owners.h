// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/api/access_control.h"
#include "server/api/client_limits.h"
#include "server/api/scene_leases.h"
#include "server/base/mutex.h"

namespace carillon {

/// Whether a call makes its scene last.
enum class SceneCall { kUses, kLooks };

/// The caller to whom each scene belongs, and the connections for which it lasts. Safe from every
/// thread.
class SceneOwners {
 public:
  /// `access`, which logs refusals, and `leases` must outlive this.
  SceneOwners(AccessControl& access, SceneLeases& leases) : access_(access), leases_(leases) {}

  /// `place` is the scene's among those of its client.
  void Add(uint64_t scene, const Principal& owner, ClientPlace place, bool keep);
  void Remove(uint64_t scene);

  SceneLeases& leases() { return leases_; }

  /// The scene, of one client's or, without a client, of all, that was abandoned for the longest
  /// time.
  std::optional<uint64_t> LongestAbandoned(const std::optional<std::string>& client);

  /// OK if the caller may use the scene: its owner and administrators may, and everybody may use
  /// a scene that does not exist, to be told so. A scene that the call uses lasts for its
  /// connection, too. Errors: PermissionDenied (SCENE_OF_ANOTHER).
  absl::Status Check(const grpc::CallbackServerContext& context, const Principal& caller,
                     uint64_t scene, SceneCall call = SceneCall::kUses) const;

  /// Returns the scene of this name if the caller may use it. Errors: those of ParseSceneName and
  /// Check.
  absl::StatusOr<uint64_t> Parse(const grpc::CallbackServerContext& context,
                                 const Principal& caller, absl::string_view name,
                                 SceneCall call = SceneCall::kUses) const;

  /// Whether the caller may use the scene.
  bool Owns(const Principal& caller, uint64_t scene) const;

 private:
  struct Owner {
    std::string name;
    std::string client;
    ClientPlace place;
  };

  AccessControl& access_;
  SceneLeases& leases_;
  mutable Mutex mutex_;
  std::map<uint64_t, Owner> owners_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
