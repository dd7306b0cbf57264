// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/output/message_json.h"

#include <google/protobuf/descriptor.h>

#include <charconv>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <variant>
#include <vector>

namespace carillon::cli {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;
using Json = nlohmann::ordered_json;

Json ToJson(const Message& message);

/// Returns the number that the shortest decimal text of a float means, so that 0.1F is 0.1.
double Shortest(float value) {
  char text[32];
  const auto written = std::to_chars(text, text + sizeof text, value);
  double shortest = 0;
  std::from_chars(text, written.ptr, shortest);
  return shortest;
}

/// Returns element `i` of a repeated field, or, if `i` is negative, the value of a single field.
Json Value(const Message& message, const FieldDescriptor& field, int i) {
  const Reflection& get = *message.GetReflection();
  const auto read = [&](auto single, auto repeated) {
    return i < 0 ? (get.*single)(message, &field) : (get.*repeated)(message, &field, i);
  };
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return read(&Reflection::GetInt32, &Reflection::GetRepeatedInt32);
    case FieldDescriptor::CPPTYPE_INT64:
      return read(&Reflection::GetInt64, &Reflection::GetRepeatedInt64);
    case FieldDescriptor::CPPTYPE_UINT32:
      return read(&Reflection::GetUInt32, &Reflection::GetRepeatedUInt32);
    case FieldDescriptor::CPPTYPE_UINT64:
      return read(&Reflection::GetUInt64, &Reflection::GetRepeatedUInt64);
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return read(&Reflection::GetDouble, &Reflection::GetRepeatedDouble);
    case FieldDescriptor::CPPTYPE_FLOAT:
      return Shortest(read(&Reflection::GetFloat, &Reflection::GetRepeatedFloat));
    case FieldDescriptor::CPPTYPE_BOOL:
      return read(&Reflection::GetBool, &Reflection::GetRepeatedBool);
    case FieldDescriptor::CPPTYPE_ENUM:
      return read(&Reflection::GetEnum, &Reflection::GetRepeatedEnum)->name();
    case FieldDescriptor::CPPTYPE_STRING:
      return read(&Reflection::GetString, &Reflection::GetRepeatedString);
    default:
      return ToJson(i < 0 ? get.GetMessage(message, &field)
                          : get.GetRepeatedMessage(message, &field, i));
  }
}

Json Elements(const Message& message, const FieldDescriptor& field) {
  Json elements = field.is_map() ? Json::object() : Json::array();
  for (int i = 0; i < message.GetReflection()->FieldSize(message, &field); ++i) {
    Json element = Value(message, field, i);
    if (field.is_map()) {
      elements[element["key"].get<std::string>()] = element["value"];
    } else {
      elements.push_back(std::move(element));
    }
  }
  return elements;
}

Json ToJson(const Message& message) {
  Json object = Json::object();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(i);
    if (field.is_repeated()) {
      object[field.name()] = Elements(message, field);
    } else if (!field.has_presence() || message.GetReflection()->HasField(message, &field)) {
      object[field.name()] = Value(message, field, -1);
    }
  }
  return object;
}

void Append(const JsonMember& member, Json& object) {
  if (const auto* const json = std::get_if<JsonText>(&member.value)) {
    object[member.name] = Json::parse(json->text);
    return;
  }
  std::visit(
      [&](const auto& value) {
        if constexpr (!std::is_same_v<decltype(value), const JsonText&>) {
          object[member.name] = value;
        }
      },
      member.value);
}

/// Text that is not UTF-8 gets a replacement character for each wrong byte.
std::string JsonLine(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string MembersJson(const std::vector<JsonMember>& members) {
  Json object = Json::object();
  for (const JsonMember& member : members) Append(member, object);
  return JsonLine(object);
}

std::string MessageJson(const Message& message, const std::vector<JsonMember>& members) {
  Json object = ToJson(message);
  for (const JsonMember& member : members) Append(member, object);
  return JsonLine(object);
}

}  // namespace carillon::cli
