// SPDX-License-Identifier: Apache-2.0
#include <toml++/toml.h>

#include <sstream>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "server/daemon/options.h"
#include "server/daemon/visit_settings.h"

namespace carillon {

std::vector<std::string> DifferentSettings(const Options& first, const Options& second) {
  std::vector<std::string> names;
  VisitSettings(first, [&](absl::string_view name, const auto& one) {
    VisitSettings(second, [&](absl::string_view other_name, const auto& other) {
      if constexpr (std::is_same_v<decltype(one), decltype(other)>) {
        if (name == other_name && one != other) names.emplace_back(name);
      }
    });
  });
  return names;
}

std::string PrintConfiguration(const Options& options) {
  std::ostringstream text;
  VisitSettings(options, [&text](const char* key, const auto& setting) {
    using Setting = std::decay_t<decltype(setting)>;
    toml::table line;
    if constexpr (std::is_same_v<Setting, std::vector<std::string>>) {
      toml::array array;
      for (const std::string& element : setting) array.push_back(element);
      line.insert(key, std::move(array));
    } else if constexpr (std::is_integral_v<Setting> && !std::is_same_v<Setting, bool>) {
      line.insert(key, static_cast<int64_t>(setting));
    } else {
      line.insert(key, setting);
    }
    text << line << "\n";
  });
  return text.str();
}

}  // namespace carillon
