// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace carillon::precompute {

/// A keyword line: "*ELEMENT, TYPE=C3D4, ELSET=BODY". Keywords and parameters are in capitals.
struct InpKeyword {
  std::string name;
  std::map<std::string, std::string> parameters;

  std::string Of(const std::string& parameter) const {
    const auto found = parameters.find(parameter);
    return found == parameters.end() ? "" : found->second;
  }
  bool Has(const std::string& parameter) const { return parameters.contains(parameter); }
};

/// Parses a line that begins with '*'. Commas within quotation marks belong to a value.
InpKeyword ParseInpKeyword(std::string_view line);

/// Returns the words between commas, without the empty one after a comma at the end.
std::vector<std::string_view> InpFields(std::string_view line);

/// Reads a number as Fortran writes it: "1.", ".5", "+1.D-3", "1-3" (1e-3). An empty field is zero.
std::optional<double> InpReal(std::string_view field);

/// Returns names that are equal except for the case of their letters as one.
std::string InpName(std::string_view name);

}  // namespace carillon::precompute
