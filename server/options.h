// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace carillon {

/// How the daemon was started: its command line over its configuration file over the defaults.
struct Options {
  std::string data_directory;
  std::vector<std::string> addresses;
  std::string audio_device = "auto";
  uint32_t sample_rate_hz = 48000;
  uint32_t block_frame_count = 128;
  uint32_t look_ahead_block_count = 8;
  int worker_count = 0;            ///< 0: half of the processors
  std::string precompute_program;  ///< carillon-precompute
  std::string tls_certificate_file;
  std::string tls_key_file;
};

/// What to do: run, or end at once with this text (--help, --version) or complaint.
struct CommandLine {
  Options options;
  bool run = false;
  int exit_status = 0;
};

/// Reads the command line and the file named by --config. Prints help, version and complaints about
/// the command line itself.
/// Errors: InvalidArgument (INVALID_CONFIGURATION: the file cannot be read, or a value is out of
/// range).
absl::StatusOr<CommandLine> ReadCommandLine(int argc, const char* const* argv,
                                            const std::string& version);

}  // namespace carillon
