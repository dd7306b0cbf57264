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
};

/// Reads recordings and finds the modes. Shows the progress on a terminal. Errors: those of
/// ReadRecording.
absl::StatusOr<Extracted> ExtractFrom(const std::vector<std::string>& paths);

/// Reads modes from a CSV file: frequency_hz and, if they are known, frequency_error_hz,
/// decay_per_s and decay_error_per_s in each line. Lines that begin with no figure are passed over.
/// Errors: InvalidArgument (RECORDING_UNREADABLE), NotFound (FILE_NOT_FOUND).
absl::StatusOr<std::vector<fit::MeasuredMode>> ReadModes(const std::string& path);

/// Writes modes as ReadModes reads them. Errors: Internal (OUTPUT_NOT_WRITABLE).
absl::Status WriteModes(const std::string& path, const std::vector<fit::MeasuredMode>& modes);

}  // namespace carillon::cli
