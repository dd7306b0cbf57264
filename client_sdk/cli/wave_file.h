// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/audio.h"

namespace carillon::cli {

/// Writes a WAV file of 24-bit samples block by block.
class WaveFile {
 public:
  /// Errors: Internal (OUTPUT_NOT_WRITABLE).
  static absl::StatusOr<WaveFile> Create(const std::string& path, uint32_t sample_rate_hz,
                                         uint32_t channel_count);
  WaveFile(WaveFile&&) noexcept;
  WaveFile& operator=(WaveFile&&) noexcept;
  /// Completes the file.
  ~WaveFile();

  /// Appends interleaved samples. Errors: Internal (OUTPUT_NOT_WRITABLE).
  absl::Status Write(std::span<const float> samples);

 private:
  struct Sound;
  explicit WaveFile(std::unique_ptr<Sound> sound);

  std::unique_ptr<Sound> sound_;
};

}  // namespace carillon::cli
