// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace carillon {

/// Figures as people write them on a command line; nullopt where a text is none.

/// "1%" or "0.01": a share above zero.
std::optional<double> ParseShare(const std::string& text);

/// Processor time in seconds and memory in GiB; zero: no bound.
struct Budget {
  double seconds = 0;
  double gib = 0;
};

/// "60" or "60:4": seconds, or seconds:GiB.
std::optional<Budget> ParseBudget(const std::string& text);

/// "m", "cm", "mm", "in", or a number of metres above zero: the length of one unit, metres.
std::optional<double> ParseUnitM(const std::string& text);

/// "3mm", "0.003m" or "0.003": a length above zero, metres.
std::optional<double> ParseLengthM(const std::string& text);

}  // namespace carillon
