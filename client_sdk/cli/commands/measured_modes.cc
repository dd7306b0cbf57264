// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/measured_modes.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

/// The standard error of a frequency of which the file gives none, relative.
constexpr double kUsualError = 1e-3;

absl::Status Malformed(const std::string& path, size_t line, absl::string_view what) {
  return Refusal(
      absl::StatusCode::kInvalidArgument, "RECORDING_UNREADABLE",
      absl::StrCat(path, ", line ", line, ": ", what,
                   "; give frequencies alone, one a line, or name the columns in the first line: "
                   "frequency_hz and any of frequency_error_hz, decay_per_s, t60_s, "
                   "decay_error_per_s, with points in the numbers and commas between them"));
}

enum class Column { kFrequency, kFrequencyError, kDecay, kT60, kDecayError, kOther };

/// Reads the names of the columns. Returns none if the line begins with a figure.
absl::StatusOr<std::vector<Column>> ParseHeader(const std::string& path,
                                                const std::vector<absl::string_view>& fields) {
  static constexpr std::pair<absl::string_view, Column> kNames[] = {
      {"frequency_hz", Column::kFrequency},
      {"frequency_error_hz", Column::kFrequencyError},
      {"decay_per_s", Column::kDecay},
      {"t60_s", Column::kT60},
      {"decay_error_per_s", Column::kDecayError},
      {"level_db", Column::kOther},
      {"signal_to_noise_db", Column::kOther}};
  std::vector<Column> columns;
  double figure = 0;
  if (absl::SimpleAtod(fields[0], &figure)) return columns;
  for (const absl::string_view field : fields) {
    const auto* const name = std::ranges::find(kNames, absl::StripAsciiWhitespace(field),
                                               [](const auto& pair) { return pair.first; });
    if (name == std::end(kNames)) {
      return Malformed(path, 1, absl::StrCat("no column is named \"", field, "\""));
    }
    columns.push_back(name->second);
  }
  if (columns[0] != Column::kFrequency)
    return Malformed(path, 1, "the first column is no frequency");
  return columns;
}

absl::StatusOr<fit::MeasuredMode> ParseMode(const std::string& path, size_t number,
                                            const std::vector<absl::string_view>& fields,
                                            const std::vector<Column>& columns) {
  fit::MeasuredMode mode;
  if (fields.size() > columns.size()) {
    return Malformed(path, number, "there are more figures than named columns");
  }
  for (size_t i = 0; i < fields.size(); ++i) {
    const absl::string_view field = absl::StripAsciiWhitespace(fields[i]);
    double figure = 0;
    if (columns[i] == Column::kOther || (i > 0 && field.empty())) continue;
    if (!absl::SimpleAtod(field, &figure) || !std::isfinite(figure)) {
      return Malformed(path, number, absl::StrCat("\"", field, "\" is no figure"));
    }
    if (columns[i] == Column::kFrequency) mode.frequency_hz = figure;
    if (columns[i] == Column::kFrequencyError) mode.frequency_error_hz = figure;
    if (columns[i] == Column::kDecay) mode.decay_per_s = figure;
    if (columns[i] == Column::kT60 && figure > 0) mode.decay_per_s = std::log(1000) / figure;
    if (columns[i] == Column::kDecayError) mode.decay_error_per_s = figure;
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
    if (const double clipped_s = fit::ClippedSeconds(recording); clipped_s > extracted.clipped_s) {
      extracted.clipped_s = clipped_s;
      extracted.clipped = path;
    }
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
  ASSIGN_OR_RETURN(const std::string bytes, ReadText(path));
  std::vector<fit::MeasuredMode> modes;
  std::vector<Column> columns;
  size_t number = 0;
  for (absl::string_view text : absl::StrSplit(bytes, '\n')) {
    ++number;
    if (number == 1) absl::ConsumePrefix(&text, "\xEF\xBB\xBF");  // a byte order mark
    text = absl::StripAsciiWhitespace(text);
    if (text.empty() || text[0] == '#') continue;
    const std::vector<absl::string_view> fields = absl::StrSplit(text, absl::ByAnyChar(",\t"));
    if (columns.empty()) {
      ASSIGN_OR_RETURN(columns, ParseHeader(path, fields));
      if (!columns.empty()) continue;
      columns = {Column::kFrequency};
    }
    ASSIGN_OR_RETURN(fit::MeasuredMode mode, ParseMode(path, number, fields, columns));
    modes.push_back(mode);
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
