// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <google/protobuf/message.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace carillon {

/// A call: its method as "carillon.v1.SceneService/AddObjects", and its requests as they are sent.
struct RequestCase {
  std::string method;
  std::vector<std::string> messages;
};

/// Reads a line with the method, and messages in protobuf's delimited form. The last message may be
/// shorter than its length says. Empty if there is no such method.
std::optional<RequestCase> ParseRequestCase(absl::string_view text);

std::string ToText(const RequestCase& request);

/// The methods of the contract.
const std::vector<std::string>& AllMethods();

/// An empty request of a method.
std::unique_ptr<google::protobuf::Message> NewRequest(const std::string& method);

}  // namespace carillon
