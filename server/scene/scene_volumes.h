// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/base/mutex.h"
#include "server/synthesis/mixer.h"

namespace carillon {

/// Checks a gain. Errors: InvalidArgument (INVALID_SETTINGS: not 0 to 1000).
absl::Status ValidateGain(double gain);

/// The volume of a scene.
struct SceneVolume {
  double gain = 1;  ///< linear
  bool muted = false;
  bool solo = false;  ///< if an owner has scenes with this flag, only these are heard
};

/// A change of a volume. Absent properties stay as they are.
struct SceneVolumeChange {
  std::optional<double> gain;
  std::optional<bool> muted;
  std::optional<bool> solo;
};

/// The volumes of all scenes. Each scene has a bus of the mixer. Safe from every thread.
class SceneVolumes {
 public:
  /// `mixer` must outlive the volumes.
  explicit SceneVolumes(Mixer& mixer) : mixer_(mixer) {}

  /// Opens the bus of a new scene. Errors: InvalidArgument (INVALID_SETTINGS), ResourceExhausted
  /// (TOO_MANY_SCENES).
  absl::StatusOr<BusId> Open(uint64_t scene, const std::string& owner, double gain);

  void Close(uint64_t scene);

  /// Changes the volume of a scene. Errors: InvalidArgument (INVALID_SETTINGS).
  absl::Status Change(uint64_t scene, const SceneVolumeChange& change);

  SceneVolume volume(uint64_t scene) const;

 private:
  struct Entry {
    BusId bus;
    std::string owner;
    SceneVolume volume;
  };

  double HeardGain(const Entry& entry) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Apply() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  Mixer& mixer_;
  mutable Mutex mutex_;
  std::map<uint64_t, Entry> entries_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
