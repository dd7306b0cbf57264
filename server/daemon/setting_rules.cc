// SPDX-License-Identifier: Apache-2.0
#include "server/daemon/setting_rules.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>

#include "absl/algorithm/container.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

constexpr double kMostMib = 0x1p40;
constexpr double kMostSeconds = 1e8;

struct Range {
  absl::string_view key;
  double least;
  double most;
};

constexpr auto kRanges = std::to_array<Range>({
    {"sample_rate", 8000, 192000},
    {"channels", 1, 2},
    {"gain", 0, 1000},
    {"full_scale_pa", kLeastFullScalePa, kMostFullScalePa},
    {"block_frames", 16, 256},
    {"look_ahead_blocks", 2, 64},
    {"workers", 0, 1024},
    {"memory_budget_mib", 0, kMostMib},
    {"job_memory_mib", 0, kMostMib},
    {"job_time", 0.1, kMostSeconds},
    {"stall_time", 0.1, kMostSeconds},
    {"scene_grace", 0, kMostSeconds},
    {"client_share", 0.001, 1},
    {"queue_limit", 1, 1e6},
    {"model_budget_mib", 0, kMostMib},
});

constexpr auto kLogLevels = std::to_array<absl::string_view>({"debug", "info", "warning", "error"});

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

}  // namespace

absl::Status InvalidConfiguration(absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_CONFIGURATION", message);
}

absl::Status AtPlace(const absl::Status& status, absl::string_view place) {
  const v1::ErrorInfo error = ToErrorInfo(status);
  return Refusal(status.code(), error.reason(), absl::StrCat(place, ": ", error.message()));
}

absl::Status CheckNumber(absl::string_view key, absl::string_view name, double value) {
  const auto* const range = std::ranges::find(kRanges, key, &Range::key);
  if (range == kRanges.end()) return absl::OkStatus();
  if (value >= range->least && value <= range->most) return absl::OkStatus();
  return InvalidConfiguration(absl::StrFormat("%s is %.15g; it must be %.15g to %.15g", name, value,
                                              range->least, range->most));
}

absl::Status CheckText(absl::string_view key, absl::string_view name, absl::string_view value) {
  const std::string is = absl::StrCat(name, " is \"", value, "\"; it must be ");
  if (key == "executor" && value != "local" && value != "slurm") {
    return InvalidConfiguration(absl::StrCat(is, "local or slurm"));
  }
  if (key == "log_level" && !absl::c_linear_search(kLogLevels, value)) {
    return InvalidConfiguration(absl::StrCat(is, "debug, info, warning or error"));
  }
  if (key == "data_dir" && value.empty()) {
    return InvalidConfiguration(absl::StrCat(name, " names no folder"));
  }
  const absl::string_view host = HostOf(value);
  if (key == "slurm_upload" && !value.empty() && host.empty()) {
    return InvalidConfiguration(absl::StrCat(is, "HOST:PORT, as the nodes reach it"));
  }
  if (key == "metrics" && !value.empty() && (host.empty() || absl::StrContains(host, ':'))) {
    return InvalidConfiguration(absl::StrCat(
        is, "one HOST:PORT with an IPv4 address or a name, as 127.0.0.1:9464; IPv6 is not served"));
  }
  return absl::OkStatus();
}

absl::Status CheckValues(int argc, const char* const* argv) {
  for (int i = 1; i < argc; ++i) {
    const absl::string_view word = argv[i];
    if (absl::StartsWith(word, "--") && word.find('=') == word.size() - 1) {
      return InvalidConfiguration(absl::StrCat("nothing follows ", word, " in the command line"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckIsFile(const std::string& path) {
  // A folder and a device can be opened, and would be empty files. A named pipe would wait for a
  // writer.
  std::error_code ignored;
  const std::filesystem::file_status file = std::filesystem::status(path, ignored);
  if (std::filesystem::is_regular_file(file) || !std::filesystem::exists(file)) {
    return absl::OkStatus();
  }
  const char* const what = std::filesystem::is_directory(file) ? "folder"
                           : std::filesystem::is_fifo(file)    ? "named pipe"
                                                               : "device or a socket";
  return InvalidConfiguration(absl::StrCat(path, ": it is a ", what, "; name a TOML file"));
}

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

}  // namespace carillon
