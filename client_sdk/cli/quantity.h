// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace carillon::cli {

/// Quantities as people write them on a command line. The functions return nullopt for a text that
/// is not such a quantity.

/// Parses a share above zero: "1%" or "0.01".
std::optional<double> ParseShare(const std::string& text);

/// A limit of processor time in seconds and of memory in GiB. Zero is no limit.
struct Budget {
  double seconds = 0;
  double gib = 0;
};

/// Parses seconds, or seconds:GiB: "60" or "60:4".
std::optional<Budget> ParseBudget(const std::string& text);

/// Parses a time and returns it as milliseconds since 1970-01-01 UTC. The text is "2026-11-21",
/// "2026-11-21T14:30" or "2026-11-21T14:30:05" in the local time zone, or has the zone of RFC 3339
/// ("2026-11-21T14:30:05Z").
std::optional<int64_t> ParseTimeUnixMs(const std::string& text);

}  // namespace carillon::cli
