// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/audio.h"

namespace carillon::cli {

/// The layout of the samples of a WAV file.
struct WaveFormat {
  uint32_t sample_rate_hz = 48000;
  uint32_t channel_count = 1;
  int bits = 24;  ///< 16 or 24; 32 for floating point

  /// Whether samples beyond full scale are clipped. Samples in floating point are not.
  bool clips() const { return bits < 32; }
};

/// Writes a WAV file block by block.
class WaveFile {
 public:
  /// `path` "-" is stdout. Errors: Internal (OUTPUT_NOT_WRITABLE).
  static absl::StatusOr<WaveFile> Create(const std::string& path, const WaveFormat& format);
  WaveFile(WaveFile&&) noexcept;
  WaveFile& operator=(WaveFile&&) noexcept;
  /// Completes the file.
  ~WaveFile();

  /// Appends interleaved samples. Errors: Internal (OUTPUT_NOT_WRITABLE).
  absl::Status Write(std::span<const float> samples);

  /// Completes the file. On stdout nothing appears before, because the length comes first in the
  /// file. Errors: Internal (OUTPUT_NOT_WRITABLE).
  absl::Status Finish();

 private:
  struct Sound;
  explicit WaveFile(std::unique_ptr<Sound> sound);

  std::unique_ptr<Sound> sound_;
};

}  // namespace carillon::cli
