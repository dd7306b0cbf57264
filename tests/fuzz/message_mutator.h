// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <google/protobuf/message.h>

#include <random>
#include <span>
#include <string>

namespace carillon {

/// Changes one field of a message, or of a message within it, at random. Texts are often one of
/// `words`, and numbers often at the end of a range.
class MessageMutator {
 public:
  using Random = std::minstd_rand;

  MessageMutator(Random& random, std::span<const std::string> words)
      : random_(random), words_(words) {}

  void Mutate(google::protobuf::Message& message);

 private:
  using Field = google::protobuf::FieldDescriptor;

  size_t Below(size_t count) { return random_() % count; }
  void ChangeSingular(google::protobuf::Message& message, const Field& field);
  void ChangeRepeated(google::protobuf::Message& message, const Field& field);
  void Add(google::protobuf::Message& message, const Field& field);
  double Number();
  int64_t Integer();
  std::string Text(const Field& field);
  int EnumValue(const Field& field);

  Random& random_;
  const std::span<const std::string> words_;
};

}  // namespace carillon
