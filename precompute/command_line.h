// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"

namespace carillon::precompute {

/// What a user asked carillon-precompute for.
struct CommandLine {
  std::string mesh_file;
  std::string output;
  v1::WorkerRequest request;  ///< completed
  bool json = false;
  int event_descriptor = -1;  ///< below zero: none
  int thread_count = 0;       ///< zero: one for each processor
  /// Help or version to be printed instead of anything else.
  std::optional<std::string> message;
};

/// The flags fill a v1::WorkerRequest, or --request names a file that holds one.
/// Errors: INVALID_SETTINGS (options that are unknown, malformed, missing or contradict each
/// other), UNKNOWN_MATERIAL, INVALID_MATERIAL.
absl::StatusOr<CommandLine> ParseCommandLine(int argc, const char* const* argv);

}  // namespace carillon::precompute
