// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <google/protobuf/message.h>

#include <string>

namespace carillon::cli {

/// Returns a message as JSON with the field names of the .proto. In contrast to protobuf's own
/// JSON, 64-bit integers are numbers. Every field without presence is there, also with its default
/// value. The message must have no bytes and no Any.
std::string MessageJson(const google::protobuf::Message& message);

}  // namespace carillon::cli
