// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client_sdk/fit/mode_extraction.h"
#include "client_sdk/fit/recording.h"

namespace carillon::cli {

/// The strikes of some recordings, and the modes found in them.
struct Extracted {
  std::vector<fit::Recording> recordings;
  std::vector<fit::Ring> rings;
  std::vector<fit::MeasuredMode> modes;
  fit::Room room;
  double gain_fall_db = 0;
  std::string clipped;   ///< the file that is clipped the longest; empty: none
  double clipped_s = 0;  ///< how long
};

/// Reads recordings and finds the modes. Shows the progress on a terminal. Errors: those of
/// ReadRecording.
absl::StatusOr<Extracted> ExtractFrom(const std::vector<std::string>& paths);

/// Reads modes from a CSV file: frequencies alone, or columns that the first line names:
/// frequency_hz and, if they are known, frequency_error_hz, decay_per_s or t60_s, and
/// decay_error_per_s. The columns that WriteModes writes besides are passed over.
/// Errors: InvalidArgument (RECORDING_UNREADABLE), NotFound (FILE_NOT_FOUND).
absl::StatusOr<std::vector<fit::MeasuredMode>> ReadModes(const std::string& path);

/// Writes modes as ReadModes reads them. Errors: Internal (OUTPUT_NOT_WRITABLE).
absl::Status WriteModes(const std::string& path, const std::vector<fit::MeasuredMode>& modes);

}  // namespace carillon::cli
