// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/header_json.h"

#include <google/protobuf/util/json_util.h>

namespace carillon::interchange {

std::string ToJson(v1::ModalModelHeader header) {
  header.clear_arrays();
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string json;
  // The header has no Any and no timestamp, so the conversion cannot fail.
  static_cast<void>(google::protobuf::util::MessageToJsonString(header, &json, options));
  return json;
}

std::optional<v1::ModalModelHeader> HeaderFromJson(const std::string& json) {
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  v1::ModalModelHeader header;
  if (!google::protobuf::util::JsonStringToMessage(json, &header, options).ok())
    return std::nullopt;
  return header;
}

}  // namespace carillon::interchange
