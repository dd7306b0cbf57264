// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/worker/v1/worker.pb.h"

namespace carillon::precompute {

/// The parsed command line of carillon-precompute.
struct CommandLine {
  std::string input;  ///< a mesh, or a stored model if request.radiate_stored_model()
  std::string output;
  std::string transfer_output;  ///< the file for the radiation, which is separate from the modes
  worker::v1::WorkerRequest request;  ///< with every default filled in
  bool json = false;
  int event_descriptor = -1;  ///< the worker writes its events to it, unless it is below zero
  int thread_count = 0;       ///< zero means one thread for each processor
  /// The text of --help or --version. If a text is set, the program prints it and does nothing
  /// else.
  std::optional<std::string> message;
};

/// Parses the command line. The flags fill a worker::v1::WorkerRequest, or --request names a file
/// that contains one.
///
/// Errors: INVALID_SETTINGS (an option is unknown, malformed or missing, or options contradict each
/// other), UNKNOWN_MATERIAL, INVALID_MATERIAL.
absl::StatusOr<CommandLine> ParseCommandLine(int argc, const char* const* argv);

}  // namespace carillon::precompute
