// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "carillon/audio.h"
#include "client_sdk/cli/output/wave_file.h"

namespace carillon::cli {

/// How a rendering is written to a file.
struct RenderedForm {
  std::string path;  ///< "-": stdout
  WaveFormat format;
  double factor = 1;       ///< of every sample
  bool normalize = false;  ///< scale the sound to a peak of 0.9 of full scale, before `factor`
  /// The length of the file. A longer sound is cut, and a shorter one is followed by silence. If
  /// the length is absent, the file is as long as the sound.
  std::optional<uint64_t> frame_count = std::nullopt;
};

/// Writes the blocks of a rendering to a file, or collects them first if their peak must be known.
class RenderedFile {
 public:
  explicit RenderedFile(RenderedForm form);

  /// Returns false after an error.
  bool Take(const client::AudioBlock& block);

  /// Forgets the blocks that a form with `normalize` has collected, so that another rendering can
  /// take their place.
  void Restart() { samples_.clear(); }

  /// Completes the file. Errors: Internal (OUTPUT_NOT_WRITABLE).
  absl::Status Finish();

  const absl::Status& status() const { return status_; }
  /// Returns the factor by which the samples were multiplied. Call it when the file is complete.
  double factor() const { return factor_; }
  /// The largest magnitude of the samples in the file, before they are clipped.
  float peak() const { return peak_; }
  /// Number of samples that were clipped to full scale. A file of 32 bits clips none.
  uint64_t clipped_count() const { return clipped_count_; }

 private:
  void Begin();
  void Write();
  void FillUp();

  const RenderedForm form_;
  double factor_;
  std::optional<WaveFile> file_;
  uint64_t written_count_ = 0;  // samples
  float peak_ = 0;
  uint64_t clipped_count_ = 0;
  std::vector<float> samples_;
  absl::Status status_;
};

}  // namespace carillon::cli
