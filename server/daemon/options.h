// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
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
  double full_scale_pa = kFullScalePa;
  std::string head_file;          ///< SOFA file for binaural scenes; if empty, libmysofa1's
  int worker_count = 0;           ///< decompositions at a time; 0 means half of the processors
  int64_t memory_budget_mib = 0;  ///< memory of all decompositions; 0: half of UsableMemoryBytes
  int64_t job_memory_mib = 0;     ///< memory of one decomposition; 0 means the whole budget
  double job_time_s = 21600;
  bool transfers = true;           ///< compute a transfer after each model
  int64_t model_budget_mib = 0;    ///< size of stored models; 0 means no limit
  std::string precompute_program;  ///< path of carillon-precompute
  std::string slurm_directory;     ///< shared with the nodes of a Slurm cluster
  std::string tls_certificate_file;
  std::string tls_key_file;
  std::string tls_client_roots_file;
  std::string access_file;         ///< path of the file of callers over TCP and their roles
  double scene_grace_s = 60;       ///< time for which a scene waits for its clients
  double client_share = 0.5;       ///< share of each limit that one client may use
  std::string metrics_address;     ///< HOST:PORT for Prometheus; if empty, metrics are not served
  std::string log_level = "info";  ///< least level that is logged: debug, info, warning or error

  bool operator==(const Options&) const = default;

  /// Whether a Slurm cluster runs the decompositions, rather than this machine.
  bool uses_slurm() const { return !slurm_directory.empty(); }
};

/// Exit status after an error in the command line or in the configuration file.
inline constexpr int kWrongUsage = 2;

/// For each setting that the configuration file gives and no flag overrides, its file and line as
/// text for people, by the name of the setting in the file.
using SettingPlaces = std::map<std::string, std::string>;

/// The parsed command line, which decides the program's next action.
struct CommandLine {
  Options options;
  SettingPlaces places{};
  bool run = false;  ///< if false, end with success (after --help and --version)
  /// "check" or "restore" if the program is to do this to the database, which no daemon
  /// may have open. If empty, the program serves.
  std::string database_command{};
  std::string backup_file{};  ///< the backup for "restore"
  bool only_check = false;    ///< set by --check-config: end after the configuration was read
  bool only_print = false;    ///< set by --print-config: print the settings in force, and end
};

/// Reads the command line and the file named by --config. Prints the help and the version. Errors:
/// InvalidArgument (INVALID_CONFIGURATION: the file cannot be read, or the file or the command line
/// has an unknown setting or a wrong value).
absl::StatusOr<CommandLine> ReadCommandLine(int argc, const char* const* argv,
                                            const std::string& version);

/// Returns the names, as in the configuration file, of the settings that differ.
std::vector<std::string> DifferentSettings(const Options& first, const Options& second);

/// Returns the settings as the text of a configuration file.
std::string PrintConfiguration(const Options& options);

/// Returns the path of a program in the folder of this executable, or `name` alone on a system
/// without /proc.
std::string ProgramBeside(const std::string& name);

/// Returns the same refusal with `place`, which is a line of the configuration file, before its
/// message.
absl::Status AtPlace(const absl::Status& status, absl::string_view place);

}  // namespace carillon
