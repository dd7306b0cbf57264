// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "carillon/audio.h"
#include "carillon/v1/audio_service.pb.h"
#include "client_sdk/cli/output/wave_file.h"
#include "server/loudness/loudness_meter.h"

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
  uint64_t fade_frame_count = 0;  ///< frames over which a sound that is cut fades out
};

/// Writes the blocks of a rendering to a file, or collects them first if their peak must be known.
class RenderedFile {
 public:
  explicit RenderedFile(RenderedForm form);

  /// Returns false after an error.
  bool Take(const client::AudioBlock& block);

  /// Forgets the blocks that a form with `normalize` has collected, so that another rendering can
  /// take their place.
  void Restart() {
    samples_.clear();
    cut_ = false;
  }

  /// Completes the file. Errors: Internal (OUTPUT_NOT_WRITABLE).
  absl::Status Finish();

  const absl::Status& status() const { return status_; }
  /// Returns the factor by which the samples were multiplied. Call it when the file is complete.
  double factor() const { return factor_; }
  /// The largest magnitude of the samples in the file, before they are clipped.
  float peak() const { return peak_; }
  /// Lets the summary of the rendering state the length, the peak and the loudness of the file in
  /// place of those of the sound before it was cut and scaled. Call it when the file is complete.
  void Describe(v1::RenderSummary& summary) const;
  /// Whether the sound was longer than the file.
  bool is_cut() const { return cut_; }
  /// Number of frames in the file. Call it when the file is complete.
  uint64_t frame_count() const { return written_count_ / form_.format.channel_count; }
  /// Number of samples that were clipped to full scale. A file of 32 bits clips none.
  uint64_t clipped_count() const { return clipped_count_; }

 private:
  void Begin();
  /// Writes the samples that were taken. Unless they are the last ones, keeps those that fade if
  /// the sound is cut.
  void Write(bool last);
  /// Drops samples beyond the length of the file, and fades the last ones out. Returns the number
  /// of samples that can be written.
  size_t Cut(bool last);
  void FillUp();

  const RenderedForm form_;
  double factor_;
  std::optional<WaveFile> file_;
  uint64_t written_count_ = 0;  // samples
  bool cut_ = false;
  float peak_ = 0;
  uint64_t clipped_count_ = 0;
  LoudnessMeter loudness_;
  std::vector<float> samples_;
  absl::Status status_;
};

}  // namespace carillon::cli
