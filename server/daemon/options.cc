// SPDX-License-Identifier: Apache-2.0
#include "server/daemon/options.h"

#include <toml++/toml.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <optional>
#include <sstream>
#include <system_error>
#include <type_traits>
#include <utility>
#include <variant>

#include "absl/algorithm/container.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/string_view.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/server_address.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

constexpr double kMostMib = 0x1p40;
constexpr double kMostSeconds = 1e8;

using Texts = std::vector<std::string>;

/// The member of Options that has a setting.
using Member =
    std::variant<std::string Options::*, Texts Options::*, bool Options::*, double Options::*,
                 int Options::*, uint32_t Options::*, int64_t Options::*>;

/// Returns what is wrong with the text of a value, or an empty string.
using Check = std::function<std::string(const std::string& value)>;

/// One setting: the name of its key in the configuration file, and of its flag with - in place of
/// _; its place, whose initial value in Options and Defaults() is its default; its description for
/// --help; and the check of its value.
struct Setting {
  std::string key;
  Member member;
  std::string help;
  Check check;
};

std::string Any(const std::string& /*value*/) { return ""; }

Check Between(double least, double most) {
  return [=](const std::string& text) -> std::string {
    double value = 0;
    if (absl::SimpleAtod(text, &value) && value >= least && value <= most) return "";
    return absl::StrFormat("\"%s\" must be a number from %.15g to %.15g", text, least, most);
  };
}

Check OneOf(const Texts& words) {
  return [=](const std::string& text) -> std::string {
    if (absl::c_linear_search(words, text)) return "";
    return absl::StrCat("\"", text, "\" must be one of ", absl::StrJoin(words, ", "));
  };
}

std::string SomeFolder(const std::string& text) { return text.empty() ? "names no folder" : ""; }

/// Returns the host of one HOST:PORT, or nothing if `text` is not one. A name or an address has
/// neither commas nor spaces; civetweb would take a comma for the begin of another address.
absl::string_view HostOf(absl::string_view text) {
  const size_t colon = text.rfind(':');
  if (colon == absl::string_view::npos || absl::StrContains(text, ',') ||
      absl::c_any_of(text, absl::ascii_isspace)) {
    return "";
  }
  int port = 0;
  const bool has_port = absl::SimpleAtoi(text.substr(colon + 1), &port);
  return has_port && port > 0 && port < 65536 ? text.substr(0, colon) : "";
}

std::string MetricsAddress(const std::string& text) {
  const absl::string_view host = HostOf(text);
  if (text.empty() || (!host.empty() && !absl::StrContains(host, ':'))) return "";
  return absl::StrCat("\"", text,
                      "\" must be one HOST:PORT with an IPv4 address or a name, as "
                      "127.0.0.1:9464; IPv6 is not served");
}

const std::vector<Setting>& Settings() {
  using O = Options;
  static const std::vector<Setting> settings = {
      {"listen", &O::addresses,
       "address to serve: unix:PATH or HOST:PORT (port 0: any free port); repeatable [a socket in "
       "$RUNTIME_DIRECTORY or $XDG_RUNTIME_DIR]",
       Any},
      {"data_dir", &O::data_directory,
       "folder of the database [$STATE_DIRECTORY, or carillon in $XDG_STATE_HOME]", SomeFolder},
      {"access_file", &O::access_file,
       "file that says who may do what over TCP, by tokens and clients' certificates", Any},
      {"tls_certificate", &O::tls_certificate_file, "PEM file with the certificate for TCP", Any},
      {"tls_key", &O::tls_key_file, "PEM file with its private key", Any},
      {"tls_client_roots", &O::tls_client_roots_file,
       "PEM file with the authorities that vouch for clients' certificates", Any},
      {"audio_device", &O::audio_device, "sound output: auto, portaudio[:NAME], null or file:PATH",
       Any},
      {"sample_rate", &O::sample_rate_hz, "frames per second", Between(8000, 192000)},
      {"channels", &O::channel_count, "1 for mono, 2 for stereo", Between(1, 2)},
      {"full_scale_pa", &O::full_scale_pa, "pressure of a sample of full scale, Pa; less is louder",
       Between(kLeastFullScalePa, kMostFullScalePa)},
      {"head", &O::head_file, "SOFA file with the head for binaural scenes", Any},
      {"block_frames", &O::block_frame_count, "frames in a rendered block", Between(16, 256)},
      {"look_ahead_blocks", &O::look_ahead_block_count, "blocks rendered ahead of the device",
       Between(2, 64)},
      {"scene_grace", &O::scene_grace_s,
       "seconds for which a scene without connections waits for its clients",
       Between(0, kMostSeconds)},
      {"client_share", &O::client_share,
       "share of all connections, scenes, streams, listeners, renderings, uploads and waiting jobs "
       "that one client may have, 0.001 to 1",
       Between(0.001, 1)},
      {"metrics", &O::metrics_address,
       "HOST:PORT at which Prometheus reads metrics, by HTTP without TLS [nowhere]",
       MetricsAddress},
      {"log_level", &O::log_level, "least level that is logged: debug, info, warning or error",
       OneOf({"debug", "info", "warning", "error"})},
      {"workers", &O::worker_count, "decompositions that run at a time; 0: half of the processors",
       Between(0, 1024)},
      {"memory_budget_mib", &O::memory_budget_mib,
       "memory of all decompositions together; 0: half of what the daemon may use",
       Between(0, kMostMib)},
      {"job_memory_mib", &O::job_memory_mib, "memory of one decomposition; 0: the whole budget",
       Between(0, kMostMib)},
      {"job_time", &O::job_time_s, "seconds that a decomposition may take",
       Between(0.1, kMostSeconds)},
      {"transfers", &O::transfers,
       "compute how the modes of each new model radiate, in a job that follows the model's", Any},
      {"model_budget_mib", &O::model_budget_mib,
       "space for stored models: beyond it the least recently sounded models are deleted, but "
       "never the newest, a sounding or a pinned one; 0: no limit",
       Between(0, kMostMib)},
      {"precompute", &O::precompute_program,
       "path of the program that computes decompositions [carillon-precompute beside carillond]",
       Any},
      {"slurm_dir", &O::slurm_directory,
       "folder shared with the nodes of a Slurm cluster, to which sbatch submits the "
       "decompositions [they run on this machine]",
       Any},
  };
  return settings;
}

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

Options Defaults() {
  Options options;
  options.data_directory = DefaultDataDirectory();
  options.addresses = {DefaultAddress()};
  options.precompute_program = ProgramBeside("carillon-precompute");
  return options;
}

absl::Status InvalidConfiguration(absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_CONFIGURATION", message);
}

/// Returns the flag for a setting of the file.
std::string FlagOf(absl::string_view key) {
  return absl::StrCat("--", absl::StrReplaceAll(key, {{"_", "-"}}));
}

void AddFlag(CLI::App& app, Options& options, const Setting& setting) {
  std::visit(
      [&](auto member) {
        auto& value = options.*member;
        using Value = std::decay_t<decltype(value)>;
        const std::string flag = FlagOf(setting.key);
        CLI::Option* option = nullptr;
        if constexpr (std::is_same_v<Value, bool>) {
          option = app.add_flag(absl::StrCat(flag, ",!--no-", flag.substr(2)), value, setting.help);
        } else {
          option = app.add_option(flag, value, setting.help)->check(setting.check);
        }
        if constexpr (std::is_same_v<Value, Texts>) option->take_all();
        // A default that depends on the machine is described by the help, in brackets.
        if (!absl::EndsWith(setting.help, "]")) option->capture_default_str();
      },
      setting.member);
}

/// Whether a value of the configuration file has the type of its setting.
bool HasTypeOf(const Setting& setting, const toml::node& node) {
  if (std::holds_alternative<std::string Options::*>(setting.member) ||
      std::holds_alternative<Texts Options::*>(setting.member)) {
    return node.is_string();
  }
  return std::holds_alternative<bool Options::*>(setting.member) ? node.is_boolean()
                                                                 : node.is_number();
}

/// Returns the words of a command line that give the setting this value.
absl::StatusOr<Texts> WordsOf(const Setting& setting, const toml::node& node) {
  if (!HasTypeOf(setting, node)) {
    return InvalidConfiguration(absl::StrCat(setting.key, " has a value of the wrong type"));
  }
  std::string text = node.value<std::string>().value_or("");
  if (!node.is_string()) {
    std::ostringstream written;
    node.visit([&](const auto& value) { written << value; });
    text = written.str();
  }
  if (text.empty()) return Texts{FlagOf(setting.key), ""};
  return Texts{absl::StrCat(FlagOf(setting.key), "=", text)};
}

/// Reads one setting of the configuration file as its flag would be read.
absl::Status ReadKey(const std::string& key, const toml::node& node, Options& options) {
  const auto setting = std::ranges::find(Settings(), key, &Setting::key);
  if (setting == Settings().end()) {
    return InvalidConfiguration(
        absl::StrCat("there is no setting \"", key,
                     "\"; a setting has the name of its flag, with _ in place of -"));
  }
  std::vector<const toml::node*> elements = {&node};
  if (std::holds_alternative<Texts Options::*>(setting->member) && node.is_array()) {
    elements.clear();
    for (const toml::node& element : *node.as_array()) elements.push_back(&element);
  }
  Texts words;
  for (const toml::node* const element : elements) {
    ASSIGN_OR_RETURN(const Texts some, WordsOf(*setting, *element));
    words.insert(words.end(), some.begin(), some.end());
  }
  if (words.empty()) return InvalidConfiguration(absl::StrCat(key, " names nothing"));
  CLI::App app;
  AddFlag(app, options, *setting);
  std::ranges::reverse(words);  // as the library wants them
  try {
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    return InvalidConfiguration(absl::StrReplaceAll(error.what(), {{FlagOf(key), key}}));
  }
  return absl::OkStatus();
}

/// Returns a line of a file as text for people. `line` is zero if the whole file is meant.
std::string PlaceIn(const std::string& path, uint32_t line) {
  return line == 0 ? path : absl::StrCat(path, " line ", line);
}

absl::Status ReadFile(const std::string& path, Options& options, SettingPlaces& places) {
  // A folder and a device can be opened, and would be empty files. A named pipe would wait for a
  // writer.
  std::error_code ignored;
  const std::filesystem::file_status file = std::filesystem::status(path, ignored);
  if (std::filesystem::exists(file) && !std::filesystem::is_regular_file(file)) {
    return InvalidConfiguration(absl::StrCat(path, ": it is no regular file; name a TOML file"));
  }
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

/// Checks which settings are given together.
absl::Status CheckTogether(const Options& options) {
  if (absl::c_linear_search(options.addresses, options.metrics_address)) {
    return InvalidConfiguration(absl::StrCat("--listen and --metrics both name ",
                                             options.metrics_address,
                                             ": give one of them another port"));
  }
  if (options.tls_certificate_file.empty() != options.tls_key_file.empty()) {
    return InvalidConfiguration("--tls-certificate and --tls-key must be given together");
  }
  if (options.tls_certificate_file.empty() && !options.tls_client_roots_file.empty()) {
    return InvalidConfiguration("--tls-client-roots needs --tls-certificate and --tls-key");
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

/// Returns the text of a usage error. That of the library for a word after "db" that is no command
/// does not name the word.
std::string MistakeText(int argc, const char* const* argv, const CLI::ParseError& error) {
  const char* const* const end = argv + argc;
  const char* const* const db = std::find(argv, end, absl::string_view("db"));
  if (db == end || error.get_name() != "RequiredError") return error.what();
  const absl::string_view word = db + 1 == end ? "" : db[1];
  if (word == "restore") return error.what();
  return absl::StrCat(
      word.empty() ? "db needs a command" : absl::StrCat("there is no command 'db ", word, "'"),
      ": give check or restore; `carillon db backup` copies the database while the daemon runs");
}

/// Parses the command line into `command`. Returns false if the program is not to run, because the
/// help or the version was printed.
absl::StatusOr<bool> ParseFlags(int argc, const char* const* argv, const std::string& version,
                                std::string& configuration, CommandLine& command) {
  CLI::App app("Makes rigid-body simulations audible.", "carillond");
  app.set_version_flag("--version", "carillond " + version);
  app.add_option("--config", configuration,
                 "TOML file whose keys are the flags, with _ in place of - "
                 "[carillond.toml in $CONFIGURATION_DIRECTORY]");
  for (const Setting& setting : Settings()) AddFlag(app, command.options, setting);
  AddDatabaseCommands(app, command);
  app.add_flag("--print-config", command.only_print,
               "print the settings in force, as a configuration file, and end");
  app.add_flag("--check-config", command.only_check,
               "check the configuration, say what is wrong, and end");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) return InvalidConfiguration(MistakeText(argc, argv, error));
    app.exit(error);
    return false;
  }
  return true;
}

/// Checks that no flag of the command line ends in "=", because it would take the next flag for its
/// value.
absl::Status CheckValues(int argc, const char* const* argv) {
  for (int i = 1; i < argc; ++i) {
    const absl::string_view word = argv[i];
    if (absl::StartsWith(word, "--") && word.find('=') == word.size() - 1) {
      return InvalidConfiguration(absl::StrCat("nothing follows ", word, " in the command line"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

std::string ProgramBeside(const std::string& name) {
  std::error_code error;
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? name : std::filesystem::path(own).replace_filename(name).string();
}

absl::Status AtPlace(const absl::Status& status, absl::string_view place) {
  const v1::ErrorInfo error = ToErrorInfo(status);
  return Refusal(status.code(), error.reason(), absl::StrCat(place, ": ", error.message()));
}

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
    ASSIGN_OR_RETURN(const bool run, ParseFlags(argc, argv, version, configuration, command));
    if (!run) return command;
  }
  for (const std::string& name : DifferentSettings(of_file, command.options)) {
    command.places.erase(name);
  }
  RETURN_IF_ERROR(WithPlace(CheckTogether(command.options), command.places));
  command.run = true;
  return command;
}

std::vector<std::string> DifferentSettings(const Options& first, const Options& second) {
  std::vector<std::string> names;
  for (const Setting& setting : Settings()) {
    const bool equal =
        std::visit([&](auto member) { return first.*member == second.*member; }, setting.member);
    if (!equal) names.push_back(setting.key);
  }
  return names;
}

std::string PrintConfiguration(const Options& options) {
  std::ostringstream text;
  for (const Setting& setting : Settings()) {
    toml::table line;
    std::visit(
        [&](auto member) {
          const auto& value = options.*member;
          using Value = std::decay_t<decltype(value)>;
          if constexpr (std::is_same_v<Value, Texts>) {
            toml::array array;
            for (const std::string& element : value) array.push_back(element);
            line.insert(setting.key, std::move(array));
          } else if constexpr (std::is_integral_v<Value> && !std::is_same_v<Value, bool>) {
            line.insert(setting.key, static_cast<int64_t>(value));
          } else {
            line.insert(setting.key, value);
          }
        },
        setting.member);
    text << line << "\n";
  }
  return text.str();
}

}  // namespace carillon
