// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/options/quantity.h"

#include <cmath>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/strip.h"
#include "absl/time/time.h"

namespace carillon::cli {

std::optional<int64_t> ParseTimeUnixMs(const std::string& text) {
  for (const char* format :
       {"%Y-%m-%d", "%Y-%m-%dT%H:%M", "%Y-%m-%dT%H:%M:%S", absl::RFC3339_full}) {
    absl::Time time;
    if (absl::ParseTime(format, text, absl::LocalTimeZone(), &time, nullptr)) {
      return absl::ToUnixMillis(time);
    }
  }
  return std::nullopt;
}

std::optional<double> ParseGain(const std::string& text) {
  absl::string_view number = text;
  constexpr double kMostGain = 1e6;
  const bool decibels = absl::EndsWithIgnoreCase(number, "dB");
  if (decibels) number.remove_suffix(2);
  double value = 0;
  if (!absl::SimpleAtod(number, &value) || !std::isfinite(value)) return std::nullopt;
  const double gain = decibels ? std::pow(10, value / 20) : value;
  return gain >= 0 && gain <= kMostGain ? std::optional<double>(gain) : std::nullopt;
}

std::optional<double> ParsePitch(const std::string& text) {
  double hz = 0;
  if (absl::SimpleAtod(text, &hz)) {
    return hz >= 1 && hz <= 1e6 ? std::optional<double>(hz) : std::nullopt;
  }
  constexpr absl::string_view kNotes = "c d ef g a b";  // by semitones
  absl::string_view rest = text;
  const size_t semitone =
      rest.empty() ? std::string::npos
                   : kNotes.find(absl::ascii_tolower(static_cast<unsigned char>(rest[0])));
  if (semitone == std::string::npos || rest[0] == ' ') return std::nullopt;
  rest.remove_prefix(1);
  const int sharp = absl::ConsumePrefix(&rest, "#") ? 1 : absl::ConsumePrefix(&rest, "b") ? -1 : 0;
  int octave = 0;
  if (!absl::SimpleAtoi(rest, &octave) || octave < -1 || octave > 12) return std::nullopt;
  return 440 * std::exp2((static_cast<int>(semitone) + sharp - 9) / 12.0 + octave - 4);
}

}  // namespace carillon::cli
