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
/// SimpleFreeFieldHRIR). The file is read when the head is first needed. Safe from every thread.
class HeadStore {
 public:
  /// If `file` is empty, uses the file of the dummy head KEMAR in the Debian package libmysofa1.
  explicit HeadStore(std::string file = "");

  /// Sets the head of a scene that asks for binaural rendering and has two channels. Does nothing
  /// for other scenes. Errors: those of Get.
  absl::Status Complete(SceneSpace& space, uint32_t sample_rate_hz, uint32_t channel_count);

  /// Returns the head at a sample rate. Errors: FailedPrecondition (HEAD_UNUSABLE: the file cannot
  /// be read or holds no measured head).
  absl::StatusOr<std::shared_ptr<const Head>> Get(uint32_t sample_rate_hz);

  /// Returns whether the file exists.
  bool available() const;

 private:
  struct Made {
    uint32_t sample_rate_hz;
    std::shared_ptr<const Head> head;
  };

  const std::string file_;
  Mutex mutex_;
  std::list<Made> heads_ ABSL_GUARDED_BY(mutex_);  ///< the heads used last, the newest first
};

}  // namespace carillon
