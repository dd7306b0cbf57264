// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

namespace carillon {

/// The importance of a line of the log.
enum class LogLevel { kDebug, kInfo, kWarning, kError };

/// Something that the log tells in one line, such as
/// `model_deleted model=modalModels/4f caller=console`: a name in snake_case, and fields.
class Event {
 public:
  struct Field {
    std::string key;  ///< in snake_case
    std::string value;
  };

  explicit Event(std::string name, LogLevel level = LogLevel::kInfo)
      : name_(std::move(name)), level_(level) {}

  /// Adds a field. A value of more than 200 bytes is cut.
  Event& With(std::string key, const absl::AlphaNum& value);

  /// Adds a field unless its value is empty.
  Event& WithSome(std::string key, const std::string& value);

  const std::string& name() const { return name_; }
  LogLevel level() const { return level_; }
  const std::vector<Field>& fields() const { return fields_; }

  /// Returns the event as one line. A value is quoted and escaped as in C if it is empty or has
  /// other bytes than printable ASCII, a space, a quote, a backslash or "=". Clients can therefore
  /// neither begin a line nor forge a field.
  std::string ToLine() const;

 private:
  std::string name_;
  LogLevel level_;
  std::vector<Field> fields_;
};

/// Takes events for the log. Any thread may call it.
using EventSink = std::function<void(const Event&)>;

}  // namespace carillon
