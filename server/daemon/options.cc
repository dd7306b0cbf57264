// SPDX-License-Identifier: Apache-2.0
#include "server/daemon/options.h"

#include <toml++/toml.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <type_traits>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/string_view.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/server_address.h"
#include "proto/cpp/status_macros.h"
#include "server/daemon/setting_rules.h"
#include "server/daemon/visit_settings.h"

namespace carillon {
namespace {

std::string Environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

/// $STATE_DIRECTORY, which systemd sets; otherwise the state folder of the XDG base directories.
std::string DefaultDataDirectory() {
  if (std::string state = Environment("STATE_DIRECTORY"); !state.empty()) return state;
  if (const std::string xdg = Environment("XDG_STATE_HOME"); !xdg.empty()) return xdg + "/carillon";
  return Environment("HOME") + "/.local/state/carillon";
}

std::string DefaultAddress() {
  const std::string runtime = Environment("RUNTIME_DIRECTORY");
  return runtime.empty() ? DefaultServerAddress() : "unix:" + runtime + "/carillond.sock";
}

/// carillond.toml in $CONFIGURATION_DIRECTORY, which systemd sets; empty if there is no such file.
std::string DefaultConfiguration() {
  const std::string folder = Environment("CONFIGURATION_DIRECTORY");
  const std::filesystem::path file = std::filesystem::path(folder) / "carillond.toml";
  // A file that this user may not see is an error, rather than no file.
  std::error_code ignored;
  const auto type = std::filesystem::status(file, ignored).type();
  return folder.empty() || type == std::filesystem::file_type::not_found ? "" : file.string();
}

/// The path of a program in the folder of this executable.
std::string Beside(const char* name) {
  return std::filesystem::read_symlink("/proc/self/exe").replace_filename(name);
}

Options Defaults() {
  Options options;
  options.data_directory = DefaultDataDirectory();
  options.addresses = {DefaultAddress()};
  options.precompute_program = Beside("carillon-precompute");
  options.audio_program = Beside("carillon-audio");
  options.slurm_client = Beside("carillon");
  return options;
}

/// Returns how a value of type T is written in the configuration file.
template <typename T>
constexpr absl::string_view WayToWrite() {
  if constexpr (std::is_same_v<T, bool>) return "true or false";
  if constexpr (std::is_same_v<T, std::string>) return "a text in quotation marks";
  return std::is_integral_v<T> ? "a whole number within its range" : "a number";
}

/// Stores one value of the configuration file in `target`.
template <typename T>
absl::Status ReadValue(absl::string_view key, const toml::node& node, T& target) {
  // toml++ would read the integer 1 as true, and true as the number 1.
  if (const auto v = node.value<T>(); v && node.is_boolean() == std::is_same_v<T, bool>) {
    target = *v;
    return absl::OkStatus();
  }
  return InvalidConfiguration(
      absl::StrCat(key, " has a value of the wrong type or size; write ", WayToWrite<T>()));
}

absl::Status ReadValue(absl::string_view key, const toml::node& node,
                       std::vector<std::string>& texts) {
  texts.clear();
  const toml::array* array = node.as_array();
  if (array == nullptr) return ReadValue(key, node, texts.emplace_back());
  if (array->empty()) {
    return InvalidConfiguration(absl::StrCat(key, " names nothing; write at least one address"));
  }
  for (const toml::node& element : *array) {
    RETURN_IF_ERROR(ReadValue(key, element, texts.emplace_back()));
  }
  return absl::OkStatus();
}

/// Checks one setting, which its user wrote as `name`.
template <typename T>
absl::Status CheckSetting(absl::string_view key, absl::string_view name, const T& setting) {
  if constexpr (std::is_same_v<T, std::string>) {
    return CheckText(key, name, setting);
  } else if constexpr (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) {
    return CheckNumber(key, name, static_cast<double>(setting));
  } else {
    return absl::OkStatus();
  }
}

absl::Status ReadKey(const std::string& key, const toml::node& node, Options& options) {
  absl::Status status = InvalidConfiguration(
      absl::StrCat("there is no setting \"", key,
                   "\"; a setting has the name of its flag, with _ in place of -"));
  VisitSettings(options, [&](absl::string_view name, auto& target) {
    if (name != key) return;
    status = ReadValue(key, node, target);
    if (status.ok()) status = CheckSetting(key, key, target);
  });
  return status;
}

/// Returns the flag for a setting of the file.
std::string FlagOf(absl::string_view key) {
  return absl::StrCat("--", absl::StrReplaceAll(key, {{"_", "-"}}));
}

/// Returns a line of a file as text for people. `line` is zero if the whole file is meant.
std::string PlaceIn(const std::string& path, uint32_t line) {
  return line == 0 ? path : absl::StrCat(path, " line ", line);
}

absl::Status ReadFile(const std::string& path, Options& options, SettingPlaces& places) {
  RETURN_IF_ERROR(CheckIsFile(path));
  try {
    const toml::table table = toml::parse_file(path);
    for (const auto& [key, node] : table) {
      const std::string place = PlaceIn(path, key.source().begin.line);
      const absl::Status status = ReadKey(std::string(key.str()), node, options);
      if (!status.ok()) return AtPlace(status, place);
      places.emplace(key.str(), place);
    }
  } catch (const toml::parse_error& error) {
    return AtPlace(InvalidConfiguration({error.description().data(), error.description().size()}),
                   PlaceIn(path, error.source().begin.line));
  }
  return absl::OkStatus();
}

/// Adds the place of a setting in the file to an error that names the setting by its flag.
absl::Status WithPlace(const absl::Status& status, const SettingPlaces& places) {
  for (const auto& [key, place] : places) {
    if (absl::StrContains(status.message(), FlagOf(key))) return AtPlace(status, place);
  }
  return status;
}

absl::Status Check(const Options& options) {
  absl::Status status = absl::OkStatus();
  VisitSettings(options, [&status](absl::string_view key, const auto& setting) {
    if (status.ok()) status = CheckSetting(key, FlagOf(key), setting);
  });
  RETURN_IF_ERROR(status);
  return CheckTogether(options);
}

/// CLI11 would read "true" as the number 1.
void RefuseWordsForNumbers(CLI::App& app) {
  CLI::Validator is_number = CLI::Number;
  is_number.description("");
  for (CLI::Option* const option : app.get_options()) {
    const std::string type = option->get_type_name();
    if (type == "INT" || type == "UINT" || type == "FLOAT") option->check(is_number);
  }
}

void AddFlags(CLI::App& app, Options& options) {
  app.add_option("--data-dir", options.data_directory, "folder of the database")
      ->capture_default_str();
  app.add_option("--listen", options.addresses,
                 "address to serve: unix:PATH or HOST:PORT (port 0: any free port); repeatable")
      ->take_all()
      ->capture_default_str();
  app.add_option("--audio-device", options.audio_device,
                 "sound output: auto, portaudio[:NAME], null or file:PATH")
      ->capture_default_str();
  app.add_option("--sample-rate", options.sample_rate_hz, "frames per second")
      ->capture_default_str();
  app.add_option("--channels", options.channel_count, "1 for mono, 2 for stereo")
      ->capture_default_str();
  app.add_option("--gain", options.gain, "linear gain of the output, before the limiter")
      ->capture_default_str();
  app.add_option("--full-scale-pa", options.full_scale_pa,
                 "pressure of a sample of full scale, Pa; less is louder")
      ->capture_default_str();
  app.add_option("--head", options.head_file, "SOFA file with the head for binaural scenes");
  app.add_option("--block-frames", options.block_frame_count, "frames in a rendered block")
      ->capture_default_str();
  app.add_option("--look-ahead-blocks", options.look_ahead_block_count,
                 "blocks rendered ahead of the device")
      ->capture_default_str();
  app.add_option("--workers", options.worker_count,
                 "decompositions that run at a time; 0: half of the processors")
      ->capture_default_str();
  app.add_option("--memory-budget-mib", options.memory_budget_mib,
                 "memory of all decompositions together; 0: half of the machine's")
      ->capture_default_str();
  app.add_option("--job-memory-mib", options.job_memory_mib,
                 "memory of one decomposition; 0: the whole budget")
      ->capture_default_str();
  app.add_option("--job-time", options.job_time_s, "seconds that a decomposition may take")
      ->capture_default_str();
  app.add_option("--stall-time", options.stall_time_s,
                 "seconds without an event after which a decomposition is ended")
      ->capture_default_str();
  app.add_flag("--transfers,!--no-transfers", options.transfers,
               "compute how the modes of each new model radiate, in a job that follows the model's")
      ->capture_default_str();
  app.add_option("--scene-grace", options.scene_grace_s,
                 "seconds for which a scene without connections waits for its clients")
      ->capture_default_str();
  app.add_option("--client-share", options.client_share,
                 "share of all connections, scenes, streams, listeners, renderings, uploads and "
                 "waiting jobs that one client may have, 0.001 to 1")
      ->capture_default_str();
  app.add_option("--metrics", options.metrics_address,
                 "HOST:PORT at which Prometheus reads metrics, by HTTP without TLS [nowhere]");
  app.add_option("--log-level", options.log_level,
                 "least level that is logged: debug, info, warning or error")
      ->capture_default_str();
  app.add_option("--queue-limit", options.queue_limit, "decompositions that may wait at a time")
      ->capture_default_str();
  app.add_option("--model-budget-mib", options.model_budget_mib,
                 "space for stored models: beyond it the least recently sounded models are "
                 "deleted, but never the newest, a sounding or a pinned one; 0: no limit")
      ->capture_default_str();
  app.add_option("--executor", options.executor,
                 "where decompositions run: local, or slurm (the cluster that sbatch submits to)")
      ->capture_default_str();
  app.add_option("--slurm-dir", options.slurm_directory,
                 "folder that every node of the cluster can read and write [in the data folder]");
  app.add_option("--slurm-partition", options.slurm_partition,
                 "partition for the jobs [the cluster's default]");
  app.add_option("--slurm-upload", options.slurm_upload,
                 "HOST:PORT at which the nodes reach this daemon: they fetch meshes from there and "
                 "upload results to it, and need no shared folder");
  app.add_option("--slurm-client", options.slurm_client,
                 "path of the program `carillon` on every node")
      ->capture_default_str();
  app.add_option("--slurm-tls-roots", options.slurm_tls_roots,
                 "path on every node of a PEM file with the root of this daemon's TLS certificate");
  app.add_option("--precompute", options.precompute_program,
                 "path of the program that computes decompositions")
      ->capture_default_str();
  app.add_option("--audio-program", options.audio_program,
                 "path of the program that opens sound cards")
      ->capture_default_str();
  app.add_option("--tls-certificate", options.tls_certificate_file,
                 "PEM file with the certificate for TCP");
  app.add_option("--tls-key", options.tls_key_file, "PEM file with its private key");
  app.add_option("--tls-client-roots", options.tls_client_roots_file,
                 "PEM file with the authorities that vouch for clients' certificates");
  app.add_option("--access-file", options.access_file,
                 "file that says who may do what over TCP, by tokens and clients' certificates");
}

/// "db check|restore FILE".
void AddDatabaseCommands(CLI::App& app, CommandLine& command) {
  CLI::App& db = *app.add_subcommand("db", "check or restore the database while no daemon runs");
  db.require_subcommand(1);
  const auto add = [&](const char* name, const char* description) {
    CLI::App* const sub = db.add_subcommand(name, description);
    sub->callback([&command, name] { command.database_command = name; });
    return sub;
  };
  add("check", "check the structure and every hash; exit status 1 if anything is damaged");
  add("restore", "replace the database by a backup")
      ->add_option("FILE", command.backup_file, "made by `carillon db backup`")
      ->required();
}

/// Parses the flags into `command`. Absent if the program is to run; otherwise its exit status.
std::optional<int> ParseFlags(int argc, const char* const* argv, const std::string& version,
                              std::string& configuration, CommandLine& command) {
  CLI::App app("Makes rigid-body simulations audible.", "carillond");
  app.set_version_flag("--version", "carillond " + version);
  app.add_option("--config", configuration,
                 "TOML file whose keys are the flags, with _ in place of - "
                 "[carillond.toml in $CONFIGURATION_DIRECTORY]");
  AddFlags(app, command.options);
  RefuseWordsForNumbers(app);
  AddDatabaseCommands(app, command);
  app.add_flag("--print-config", command.only_print,
               "print the settings in force, as a configuration file, and end");
  app.add_flag("--check-config", command.only_check,
               "check the configuration, say what is wrong, and end");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongUsage;
  }
  return std::nullopt;
}

}  // namespace

absl::StatusOr<CommandLine> ReadCommandLine(int argc, const char* const* argv,
                                            const std::string& version) {
  RETURN_IF_ERROR(CheckValues(argc, argv));
  CommandLine command{.options = Defaults()};
  std::string configuration = DefaultConfiguration();
  Options of_file = command.options;
  // The flags are parsed twice: for the name of the file, and to override the file's settings.
  for (const bool with_file : {false, true}) {
    if (with_file) {
      if (configuration.empty()) break;
      of_file = Defaults();
      RETURN_IF_ERROR(ReadFile(configuration, of_file, command.places));
      command.options = of_file;
    }
    if (const auto exit_status = ParseFlags(argc, argv, version, configuration, command)) {
      command.exit_status = *exit_status;
      return command;
    }
  }
  for (const std::string& name : DifferentSettings(of_file, command.options)) {
    command.places.erase(name);
  }
  RETURN_IF_ERROR(WithPlace(Check(command.options), command.places));
  command.run = true;
  return command;
}

}  // namespace carillon
