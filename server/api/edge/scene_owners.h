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
#include "server/api/edge/access/access_control.h"
#include "server/api/edge/client_limits.h"
#include "server/api/edge/scene_leases.h"
#include "server/base/mutex.h"
#include "server/scene/scene_registry.h"

namespace carillon {

/// Whether a call uses its scene, so that the scene lasts, or only looks at it.
enum class SceneCall { kUses, kLooks };

/// The settings with which a caller makes a scene.
struct SceneWish {
  SceneSpace space{};
  double gain = 1;
  bool keep = false;

  bool operator==(const SceneWish&) const = default;
};

/// The owner of each scene, and the connections for which the scene lasts. Safe from every thread.
class SceneOwners {
 public:
  /// `access`, which logs refusals, `leases` and `scenes` must outlive this.
  SceneOwners(AccessControl& access, SceneLeases& leases, const SceneRegistry& scenes)
      : access_(access), leases_(leases), scenes_(scenes) {}

  /// Adds a scene. `place` is the scene's place in the limits of its client.
  void Add(uint64_t scene, const Principal& owner, ClientPlace place, const SceneWish& wish);
  void Remove(uint64_t scene);

  SceneLeases& leases() { return leases_; }

  /// Returns the scene that was abandoned for the longest time, among those of one client or,
  /// without a client, among all scenes.
  std::optional<uint64_t> LongestAbandoned(const std::optional<std::string>& client);

  /// Returns OK if the caller is the owner of the scene or an administrator. Also returns OK if the
  /// scene does not exist, because the next step reports that to the caller. If the call uses the
  /// scene, the scene also lasts for the call's connection. Errors: PermissionDenied
  /// (SCENE_OF_ANOTHER).
  absl::Status Check(const grpc::CallbackServerContext& context, const Principal& caller,
                     uint64_t scene, SceneCall call = SceneCall::kUses) const;

  /// Returns OK if this caller made the scene with the same wish. The scene then also lasts for the
  /// call's connection. Errors: AlreadyExists (SCENE_ID_TAKEN, SCENE_DIFFERS), NotFound
  /// (SCENE_NOT_FOUND: it was deleted meanwhile).
  absl::Status CheckMadeBy(const grpc::CallbackServerContext& context, const Principal& caller,
                           uint64_t scene, const SceneWish& wish) const;

  /// Returns the scene of this name if the caller may use it. Errors: those of ParseSceneName,
  /// SceneRegistry::FindId and Check.
  absl::StatusOr<uint64_t> Parse(const grpc::CallbackServerContext& context,
                                 const Principal& caller, absl::string_view name,
                                 SceneCall call = SceneCall::kUses) const;

  /// Returns all scenes of the client that made this scene. The list is empty if this scene does
  /// not exist.
  std::vector<uint64_t> ScenesOfItsClient(uint64_t scene) const;

  /// Returns whether the caller may use the scene.
  bool Owns(const Principal& caller, uint64_t scene) const;

 private:
  struct Owner {
    std::string name;
    std::string client;
    ClientPlace place;
    SceneWish wish;
  };

  /// The owner of a scene and the wish with which it was made.
  struct Made {
    std::string owner;
    SceneWish wish;
  };
  std::optional<Made> FindMade(uint64_t scene) const;

  AccessControl& access_;
  SceneLeases& leases_;
  const SceneRegistry& scenes_;
  mutable Mutex mutex_;
  std::map<uint64_t, Owner> owners_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
