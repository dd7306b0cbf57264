// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <google/protobuf/message.h>

#include <map>
#include <string>
#include <variant>
#include <vector>

namespace carillon::cli {

/// A value that is JSON already.
struct JsonText {
  std::string text;
};

/// A member of a JSON object that is no message of the contract.
struct JsonMember {
  const char* name;
  std::variant<std::string, bool, uint64_t, double, std::vector<std::string>, std::vector<double>,
               std::map<std::string, std::string>, JsonText>
      value;
};

/// Returns an object with the members in their order, as JSON in one line. Text that is not UTF-8,
/// as names of files may be, gets a replacement character for each wrong byte. A number that is not
/// finite is null.
std::string MembersJson(const std::vector<JsonMember>& members);

/// Returns a message as JSON with the field names of the .proto, followed by the members. In
/// contrast to protobuf's own JSON, 64-bit integers are numbers. Every field without presence is
/// there, also with its default value. The message must have no bytes and no Any.
std::string MessageJson(const google::protobuf::Message& message,
                        const std::vector<JsonMember>& members = {});

}  // namespace carillon::cli
