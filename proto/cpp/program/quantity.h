// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace carillon {

/// These functions read figures from a command line. They return nullopt if the text is no figure.

/// Reads a share above zero and below one, such as "1%" or "0.01".
std::optional<double> ParseShare(const std::string& text);

/// Processor time and memory. Zero means no bound.
struct Budget {
  double seconds = 0;
  double gib = 0;
};

/// Reads seconds or seconds:GiB, such as "60" or "60:4".
std::optional<Budget> ParseBudget(const std::string& text);

/// Reads the length of one unit, metres, from "m", "cm", "mm", "in", or a number of metres above
/// zero.
std::optional<double> ParseUnitM(const std::string& text);

/// Reads a length above zero, metres, such as "3mm", "0.003m" or "0.003".
std::optional<double> ParseLengthM(const std::string& text);

}  // namespace carillon
