// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace carillon::interchange {

/// Returns the member `key` of `object`, or a null if there is none or `object` is no object.
const nlohmann::json& Member(const nlohmann::json& object, const char* key);

/// Returns `value` if it is a whole number that is not negative, otherwise nullopt.
std::optional<uint64_t> Whole(const nlohmann::json& value);

/// Returns `value` if it is a finite number, otherwise nullopt.
std::optional<double> Number(const nlohmann::json& value);

/// Returns `value` if it is a text, otherwise an empty text.
std::string Text(const nlohmann::json& value);

}  // namespace carillon::interchange
