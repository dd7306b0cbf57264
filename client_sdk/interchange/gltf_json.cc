// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/gltf_json.h"

#include <cmath>

namespace carillon::interchange {

namespace {
using nlohmann::json;
}  // namespace

const json& Member(const json& object, const char* key) {
  static const json nothing;
  if (!object.is_object()) return nothing;
  const auto found = object.find(key);
  return found == object.end() ? nothing : *found;
}

std::optional<uint64_t> Whole(const json& value) {
  if (value.is_number_unsigned()) return value.get<uint64_t>();
  return std::nullopt;
}

std::optional<double> Number(const json& value) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) return std::nullopt;
  return value.get<double>();
}

std::string Text(const json& value) { return value.is_string() ? value.get<std::string>() : ""; }

}  // namespace carillon::interchange
