// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"

namespace carillon::precompute {

/// The parsed command line of carillon-precompute.
struct CommandLine {
  std::string input;  ///< a mesh, or a stored model where request.radiate_stored_model()
  std::string output;
  std::string transfer_output;  ///< where the radiation beside the modes goes
  v1::WorkerRequest request;    ///< with every default filled in
  bool json = false;
  int event_descriptor = -1;  ///< the worker writes its events there; below zero: nowhere
  int thread_count = 0;       ///< zero: one thread for each processor
  /// The help or the version. If it is set, the program prints it and does nothing else.
  std::optional<std::string> message;
};

/// Parses the command line. The flags fill a v1::WorkerRequest, or --request names a file that
/// contains one.
///
/// Errors: INVALID_SETTINGS (options that are unknown, malformed, missing or contradict each
/// other), UNKNOWN_MATERIAL, INVALID_MATERIAL.
absl::StatusOr<CommandLine> ParseCommandLine(int argc, const char* const* argv);

}  // namespace carillon::precompute
