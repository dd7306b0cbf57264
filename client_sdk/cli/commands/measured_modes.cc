// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/measured_modes.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

/// The standard error of a frequency of which the file gives none, relative.
constexpr double kUsualError = 1e-3;

absl::Status Malformed(const std::string& path, size_t line, absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "RECORDING_UNREADABLE",
                 absl::StrCat(path, ", line ", line, ": ", what,
                              "; each line has frequency_hz,frequency_error_hz,decay_per_s,"
                              "decay_error_per_s, or the first of them only"));
}

/// Reads one line. Returns nothing for a line that begins with no figure.
absl::StatusOr<std::optional<fit::MeasuredMode>> ParseMode(const std::string& path, size_t number,
                                                           const std::string& line) {
  const std::vector<absl::string_view> fields = absl::StrSplit(line, absl::ByAnyChar(",;\t"));
  fit::MeasuredMode mode;
  if (!absl::SimpleAtod(fields[0], &mode.frequency_hz)) return std::nullopt;
  double* const figures[] = {&mode.frequency_hz, &mode.frequency_error_hz, &mode.decay_per_s,
                             &mode.decay_error_per_s};
  for (size_t i = 1; i < std::min<size_t>(4, fields.size()); ++i) {
    const bool given = !absl::StripAsciiWhitespace(fields[i]).empty();
    if (given && !(absl::SimpleAtod(fields[i], figures[i]) && std::isfinite(*figures[i]))) {
      return Malformed(path, number, absl::StrCat("\"", fields[i], "\" is no figure"));
    }
  }
  if (!(mode.frequency_hz > 0 && mode.frequency_hz < 1e6)) {
    return Malformed(path, number, "a frequency must be above zero and below 1 MHz");
  }
  if (mode.frequency_error_hz <= 0) mode.frequency_error_hz = kUsualError * mode.frequency_hz;
  if (mode.decay_error_per_s <= 0) mode.decay_error_per_s = 0.1 * mode.decay_per_s;
  return mode;
}

}  // namespace

absl::StatusOr<Extracted> ExtractFrom(const std::vector<std::string>& paths) {
  Extracted extracted;
  for (const std::string& path : paths) {
    ASSIGN_OR_RETURN(fit::Recording recording, fit::ReadRecording(path));
    extracted.recordings.push_back(std::move(recording));
  }
  extracted.rings = fit::FindRings(extracted.recordings);
  const bool shows = isatty(STDERR_FILENO) != 0;
  fit::ExtractedModes found = fit::ExtractModes(extracted.rings, [shows](double done) {
    if (shows) absl::FPrintF(stderr, "\rlooking for modes: %3.0f %%", 100 * done);
  });
  extracted.modes = std::move(found.modes);
  extracted.room = found.room;
  extracted.gain_fall_db = found.gain_fall_db;
  if (shows) absl::FPrintF(stderr, "\r\033[K");
  return extracted;
}

absl::StatusOr<std::vector<fit::MeasuredMode>> ReadModes(const std::string& path) {
  std::ifstream file(path);
  if (!file) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat(path, " cannot be read: see its name and rights"));
  }
  std::vector<fit::MeasuredMode> modes;
  std::string line;
  for (size_t number = 1; std::getline(file, line); ++number) {
    ASSIGN_OR_RETURN(std::optional<fit::MeasuredMode> mode, ParseMode(path, number, line));
    if (mode) modes.push_back(*std::move(mode));
  }
  if (modes.empty()) return Malformed(path, 1, "the file has no frequency");
  std::ranges::sort(modes, {}, &fit::MeasuredMode::frequency_hz);
  return modes;
}

absl::Status WriteModes(const std::string& path, const std::vector<fit::MeasuredMode>& modes) {
  std::string text =
      "frequency_hz,frequency_error_hz,decay_per_s,decay_error_per_s,level_db,signal_to_noise_db\n";
  for (const fit::MeasuredMode& mode : modes) {
    absl::StrAppendFormat(&text, "%.4f,%.4f,%.5g,%.3g,%.2f,%.1f\n", mode.frequency_hz,
                          mode.frequency_error_hz, mode.decay_per_s, mode.decay_error_per_s,
                          mode.level_db, mode.signal_to_noise_db);
  }
  return WriteText(path, text);
}

}  // namespace carillon::cli
