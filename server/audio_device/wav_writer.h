// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "absl/status/statusor.h"

namespace carillon {

/// Writes a WAV file of float32 samples (WAVE_FORMAT_EXTENSIBLE; RF64 beyond 4 GiB). The header is
/// updated with each write, so that a file is readable even if its writer was killed.
class WavWriter {
 public:
  /// Truncates or creates `path`. Errors: FailedPrecondition (OUTPUT_NOT_WRITABLE).
  static absl::StatusOr<WavWriter> Make(const std::string& path, uint32_t sample_rate_hz,
                                        uint32_t channel_count);

  /// Appends interleaved frames. Errors: DataLoss (OUTPUT_NOT_WRITABLE), for instance because the
  /// disk is full. The file then lacks these frames, and the next frames follow the last ones that
  /// were written.
  absl::Status Write(std::span<const float> frames);

 private:
  struct CloseFile {
    void operator()(void* file) const;
  };
  using File = std::unique_ptr<void, CloseFile>;

  WavWriter(File file, std::string path, uint32_t channel_count);

  File file_;
  std::string path_;
  uint32_t channel_count_;
  int64_t frame_count_ = 0;  ///< frames written completely
  bool failed_ = false;      ///< the newest frames were not written completely
};

}  // namespace carillon
