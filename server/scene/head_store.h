// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/base/mutex.h"
#include "server/scene/scene_space.h"
#include "server/synthesis/voice/head.h"

namespace carillon {

/// The measured head through which scenes are heard binaurally, from a SOFA file (AES69, convention
/// SimpleFreeFieldHRIR). It is read when it is needed first. Safe from every thread.
class HeadStore {
 public:
  /// Empty: the file that the Debian package libmysofa1 brings, of the dummy head KEMAR.
  explicit HeadStore(std::string file = "");

  /// Sets the head of a scene that asks for binaural rendering, if it sounds on two channels; does
  /// nothing for others. Errors: those of Get.
  absl::Status Complete(SceneSpace& space, uint32_t sample_rate_hz, uint32_t channel_count);

  /// Returns the head at a sample rate. Errors: FailedPrecondition (HEAD_UNUSABLE: the file cannot
  /// be read or holds no measured head).
  absl::StatusOr<std::shared_ptr<const Head>> Get(uint32_t sample_rate_hz);

  /// Whether the file is there.
  bool available() const;

 private:
  struct Made {
    uint32_t sample_rate_hz;
    std::shared_ptr<const Head> head;
  };

  const std::string file_;
  Mutex mutex_;
  std::list<Made> heads_ ABSL_GUARDED_BY(mutex_);  ///< those used last, the newest first
};

}  // namespace carillon
