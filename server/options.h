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
  uint32_t channel_count = 1;
  int worker_count = 0;           ///< 0: half of the processors
  int64_t memory_budget_mib = 0;  ///< of all decompositions; 0: half of the machine's
  int64_t job_memory_mib = 0;     ///< of one; 0: the budget
  double job_time_s = 21600;
  double stall_time_s = 60;        ///< without a sign of life
  int64_t queue_limit = 1024;      ///< jobs that wait
  int64_t model_budget_mib = 0;    ///< of stored models; 0: without limit
  std::string executor = "local";  ///< or "slurm"
  std::string slurm_directory;     ///< shared with the nodes; empty: "slurm" in the data folder
  std::string slurm_partition;     ///< empty: the default one
  std::string slurm_upload;        ///< the daemon as the nodes reach it; empty: a shared folder
  std::string slurm_client;        ///< `carillon`, on every node
  std::string slurm_tls_roots;     ///< PEM file on every node
  std::string precompute_program;  ///< carillon-precompute
  std::string tls_certificate_file;
  std::string tls_key_file;
  std::string admin_token_file;
};

/// What to do: run, or end at once with this text (--help, --version) or complaint.
struct CommandLine {
  Options options;
  bool run = false;
  /// Empty: serve. Else what to do with the database, which no daemon may have open: "check",
  /// "repair" or "restore".
  std::string database_command{};
  std::string backup_file{};  ///< to restore
  int exit_status = 0;
};

/// Reads the command line and the file named by --config. Prints help, version and complaints about
/// the command line itself.
/// Errors: InvalidArgument (INVALID_CONFIGURATION: the file cannot be read, or a value is out of
/// range).
absl::StatusOr<CommandLine> ReadCommandLine(int argc, const char* const* argv,
                                            const std::string& version);

}  // namespace carillon
