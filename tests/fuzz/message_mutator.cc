// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/message_mutator.h"

#include <cstdint>
#include <limits>
#include <vector>

namespace carillon {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

/// The message and all messages in it.
void Collect(Message& message, std::vector<Message*>& messages) {
  messages.push_back(&message);
  const Reflection& reflection = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const FieldDescriptor* const field : fields) {
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE || field->is_map()) continue;
    if (!field->is_repeated()) {
      Collect(*reflection.MutableMessage(&message, field), messages);
      continue;
    }
    for (int i = 0; i < reflection.FieldSize(message, field); ++i) {
      Collect(*reflection.MutableRepeatedMessage(&message, field, i), messages);
    }
  }
}

}  // namespace

void MessageMutator::Mutate(Message& message) {
  std::vector<Message*> messages;
  Collect(message, messages);
  Message& changed = *messages[Below(messages.size())];
  const Descriptor& type = *changed.GetDescriptor();
  if (type.field_count() == 0) return;
  const FieldDescriptor& field =
      *type.field(static_cast<int>(Below(static_cast<size_t>(type.field_count()))));
  if (field.is_repeated()) return ChangeRepeated(changed, field);
  if (Below(6) == 0) return changed.GetReflection()->ClearField(&changed, &field);
  ChangeSingular(changed, field);
}

void MessageMutator::ChangeSingular(Message& message, const Field& field) {
  const Reflection& reflection = *message.GetReflection();
  switch (field.cpp_type()) {
    case Field::CPPTYPE_DOUBLE:
      return reflection.SetDouble(&message, &field, Number());
    case Field::CPPTYPE_FLOAT:
      return reflection.SetFloat(&message, &field, static_cast<float>(Number()));
    case Field::CPPTYPE_INT32:
      return reflection.SetInt32(&message, &field, static_cast<int32_t>(Integer()));
    case Field::CPPTYPE_INT64:
      return reflection.SetInt64(&message, &field, Integer());
    case Field::CPPTYPE_UINT32:
      return reflection.SetUInt32(&message, &field, static_cast<uint32_t>(Integer()));
    case Field::CPPTYPE_UINT64:
      return reflection.SetUInt64(&message, &field, static_cast<uint64_t>(Integer()));
    case Field::CPPTYPE_BOOL:
      return reflection.SetBool(&message, &field, Below(2) == 0);
    case Field::CPPTYPE_ENUM:
      return reflection.SetEnumValue(&message, &field, EnumValue(field));
    case Field::CPPTYPE_STRING:
      return reflection.SetString(&message, &field, Text(field));
    case Field::CPPTYPE_MESSAGE:
      Mutate(*reflection.MutableMessage(&message, &field));
  }
}

void MessageMutator::ChangeRepeated(Message& message, const Field& field) {
  const Reflection& reflection = *message.GetReflection();
  const int count = reflection.FieldSize(message, &field);
  if (count == 0 || Below(2) == 0) return Add(message, field);
  if (Below(2) == 0) return reflection.RemoveLast(&message, &field);
  const int other = static_cast<int>(Below(static_cast<size_t>(count)));
  reflection.SwapElements(&message, &field, count - 1, other);
  reflection.RemoveLast(&message, &field);
  Add(message, field);
}

void MessageMutator::Add(Message& message, const Field& field) {
  const Reflection& reflection = *message.GetReflection();
  switch (field.cpp_type()) {
    case Field::CPPTYPE_DOUBLE:
      return reflection.AddDouble(&message, &field, Number());
    case Field::CPPTYPE_FLOAT:
      return reflection.AddFloat(&message, &field, static_cast<float>(Number()));
    case Field::CPPTYPE_INT32:
      return reflection.AddInt32(&message, &field, static_cast<int32_t>(Integer()));
    case Field::CPPTYPE_INT64:
      return reflection.AddInt64(&message, &field, Integer());
    case Field::CPPTYPE_UINT32:
      return reflection.AddUInt32(&message, &field, static_cast<uint32_t>(Integer()));
    case Field::CPPTYPE_UINT64:
      return reflection.AddUInt64(&message, &field, static_cast<uint64_t>(Integer()));
    case Field::CPPTYPE_BOOL:
      return reflection.AddBool(&message, &field, Below(2) == 0);
    case Field::CPPTYPE_ENUM:
      return reflection.AddEnumValue(&message, &field, EnumValue(field));
    case Field::CPPTYPE_STRING:
      return reflection.AddString(&message, &field, Text(field));
    case Field::CPPTYPE_MESSAGE: {
      const int count = reflection.FieldSize(message, &field);
      Message& added = *reflection.AddMessage(&message, &field);
      if (count > 0 && !field.is_map()) {
        added.CopyFrom(reflection.GetRepeatedMessage(message, &field, count - 1));
      }
      Mutate(added);
    }
  }
}

double MessageMutator::Number() {
  using Limits = std::numeric_limits<double>;
  static constexpr double kEnds[] = {0,
                                     -0.0,
                                     1,
                                     -1,
                                     0.01,
                                     0.5,
                                     20,
                                     1e3,
                                     1e6,
                                     1e10,
                                     1e20,
                                     3e38,
                                     -3e38,
                                     1e300,
                                     1e-9,
                                     1e-300,
                                     Limits::infinity(),
                                     -Limits::infinity(),
                                     Limits::quiet_NaN(),
                                     Limits::denorm_min()};
  if (Below(2) == 0) return kEnds[Below(std::size(kEnds))];
  return std::normal_distribution<double>(0, 1)(random_);
}

int64_t MessageMutator::Integer() {
  using Limits = std::numeric_limits<int64_t>;
  static constexpr int64_t kEnds[] = {
      0,         1,          2,         3,      -1,     255,           65536,        INT32_MAX,
      INT32_MIN, UINT32_MAX, 1'000'000, 44'100, 48'000, Limits::max(), Limits::min()};
  if (Below(2) == 0) return kEnds[Below(std::size(kEnds))];
  return static_cast<int64_t>(Below(10));
}

std::string MessageMutator::Text(const Field& field) {
  if (Below(4) != 0) return words_[Below(words_.size())];
  std::string text(Below(Below(8) == 0 ? 400 : 9), ' ');
  // A parser refuses other bytes in a field of type string before the daemon sees them.
  const size_t letters = field.type() == Field::TYPE_BYTES ? 256 : 128;
  for (char& letter : text) letter = static_cast<char>(Below(letters));
  return text;
}

int MessageMutator::EnumValue(const Field& field) {
  const auto& type = *field.enum_type();
  if (Below(8) == 0) return static_cast<int>(Below(100));
  return type.value(static_cast<int>(Below(static_cast<size_t>(type.value_count()))))->number();
}

}  // namespace carillon
