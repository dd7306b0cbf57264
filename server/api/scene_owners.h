// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/api/access_control.h"
#include "server/base/mutex.h"

namespace carillon {

/// The caller to whom each scene belongs. Safe from every thread.
class SceneOwners {
 public:
  /// `access`, which logs refusals, must outlive this.
  explicit SceneOwners(AccessControl& access) : access_(access) {}

  void Add(uint64_t scene, const std::string& owner);
  void Remove(uint64_t scene);

  /// OK if the caller may use the scene: its owner and administrators may, and everybody may use
  /// a scene that does not exist, to be told so. Errors: PermissionDenied (SCENE_OF_ANOTHER).
  absl::Status Check(const grpc::CallbackServerContext& context, const Principal& caller,
                     uint64_t scene) const;

  /// Returns the scene of this name if the caller may use it. Errors: those of ParseSceneName and
  /// Check.
  absl::StatusOr<uint64_t> Parse(const grpc::CallbackServerContext& context,
                                 const Principal& caller, absl::string_view name) const;

  /// Whether the caller may use the scene.
  bool Owns(const Principal& caller, uint64_t scene) const;

 private:
  AccessControl& access_;
  mutable Mutex mutex_;
  std::map<uint64_t, std::string> owners_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
