// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace carillon::cli {

/// Parses a time and returns it as milliseconds since 1970-01-01 UTC. The text is "2026-11-21",
/// "2026-11-21T14:30" or "2026-11-21T14:30:05" in the local time zone, or has the zone of RFC 3339
/// ("2026-11-21T14:30:05Z").
std::optional<int64_t> ParseTimeUnixMs(const std::string& text);

/// Parses a gain and returns it as a factor. The text is a factor from 0 to 1e6, such as "0.5",
/// or decibels, such as "-6dB".
std::optional<double> ParseGain(const std::string& text);

/// Parses a pitch and returns it in Hz. The text is a note of the equal temperament with A4 at 440
/// Hz, such as "A4", "C#5" or "Bb3", or a frequency from 1 Hz to 1 MHz, such as "587.33".
std::optional<double> ParsePitch(const std::string& text);

}  // namespace carillon::cli
