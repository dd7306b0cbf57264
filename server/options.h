// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/synthesis/bank/level.h"

namespace carillon {

/// The settings of the daemon. A flag of the command line overrides the configuration file, which
/// overrides the default.
struct Options {
  std::string data_directory;
  std::vector<std::string> addresses;
  std::string audio_device = "auto";
  uint32_t sample_rate_hz = 48000;
  uint32_t block_frame_count = 128;
  uint32_t look_ahead_block_count = 8;
  uint32_t channel_count = 1;
  double gain = 1;  ///< of the output, linear
  double full_scale_pa = kFullScalePa;
  std::string head_file;          ///< SOFA file for binaural scenes; empty: libmysofa1's
  int worker_count = 0;           ///< decompositions at a time; 0: half of the processors
  int64_t memory_budget_mib = 0;  ///< of all decompositions together; 0: half of the machine's
  int64_t job_memory_mib = 0;     ///< of one decomposition; 0: the whole budget
  double job_time_s = 21600;
  double stall_time_s = 60;        ///< without an event of the worker
  int64_t queue_limit = 1024;      ///< jobs that wait at a time
  bool transfers = true;           ///< compute the transfer of each model after it
  int64_t model_budget_mib = 0;    ///< of stored models; 0: without limit
  std::string executor = "local";  ///< or "slurm"
  std::string slurm_directory;     ///< shared with the nodes; empty: "slurm" in the data folder
  std::string slurm_partition;     ///< empty: the cluster's default
  std::string
      slurm_upload;  ///< HOST:PORT at which nodes reach the daemon; empty: a folder is shared
  std::string slurm_client;        ///< path of `carillon` on every node
  std::string slurm_tls_roots;     ///< path of a PEM file on every node
  std::string precompute_program;  ///< path of carillon-precompute
  std::string audio_program;       ///< path of carillon-audio
  std::string tls_certificate_file;
  std::string tls_key_file;
  std::string tls_client_roots_file;
  std::string access_file;      ///< who may do what over TCP
  double scene_grace_s = 60;    ///< for which a scene waits for its clients
  double client_share = 0.5;    ///< of what all clients may hold, for one
  std::string metrics_address;  ///< HOST:PORT for Prometheus; empty: none

  bool operator==(const Options&) const = default;
};

/// Exit status after an error in the command line or in the configuration file.
inline constexpr int kWrongUsage = 2;

/// The parsed command line, which decides the program's next action.
struct CommandLine {
  Options options;
  bool run = false;  ///< false: end with exit_status, after --help, --version or a wrong flag
  /// Empty: serve. "check", "repair" or "restore": do this to the database, which no daemon may
  /// have open.
  std::string database_command{};
  std::string backup_file{};  ///< for "restore"
  bool only_check = false;    ///< with --check-config: end after the configuration was read
  bool only_print = false;    ///< with --print-config: print the settings in force, and end
  int exit_status = 0;
};

/// Reads the command line and the file named by --config. Prints the help, the version and errors
/// of the command line. Errors: InvalidArgument (INVALID_CONFIGURATION: the file cannot be read, or
/// a value is out of range).
absl::StatusOr<CommandLine> ReadCommandLine(int argc, const char* const* argv,
                                            const std::string& version);

/// The settings as a configuration file.
std::string PrintConfiguration(const Options& options);

}  // namespace carillon
