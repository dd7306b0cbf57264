// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace carillon::cli {

/// Figures as people write them on a command line; nullopt for what is none.

/// "1%" or "0.01": a share above zero.
std::optional<double> ParseShare(const std::string& text);

/// Processor time in seconds and memory in GiB; zero: no bound.
struct Budget {
  double seconds = 0;
  double gib = 0;
};

/// "60" or "60:4": seconds, or seconds:GiB.
std::optional<Budget> ParseBudget(const std::string& text);

/// "2026-11-21", "2026-11-21T14:30" or "2026-11-21T14:30:05" in the local time zone, or with a zone
/// as RFC 3339 has it ("2026-11-21T14:30:05Z"). Milliseconds since 1970-01-01 UTC.
std::optional<int64_t> ParseTimeUnixMs(const std::string& text);

}  // namespace carillon::cli
