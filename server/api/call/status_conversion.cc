// SPDX-License-Identifier: Apache-2.0
#include "server/api/call/status_conversion.h"

#include <utility>

#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/utf8.h"
#include "server/mode_database/utf8_prefix.h"

namespace carillon {
namespace {

constexpr size_t kMostFigureBytes = 200;

/// The last bytes of text, from the beginning of a character on.
std::string_view Utf8Suffix(std::string_view text, size_t most_bytes) {
  if (text.size() > most_bytes) text.remove_prefix(text.size() - most_bytes);
  while (!text.empty() && ContinuesCharacter(text.front())) text.remove_prefix(1);
  return text;
}

/// Cuts the middle out of text that is too long.
std::string Shorten(std::string_view text, size_t most_bytes) {
  constexpr std::string_view kGap = " ... ";
  if (text.size() <= most_bytes) return std::string(text);
  const size_t end = most_bytes / 3;
  std::string shortened = Utf8Prefix(text, most_bytes - end - kGap.size());
  return shortened.append(kGap).append(Utf8Suffix(text, end));
}

}  // namespace

std::string Legible(std::string_view text, size_t most_bytes) {
  return Shorten(EscapedText(Shorten(text, most_bytes)), most_bytes);
}

v1::ErrorInfo ToLegibleErrorInfo(const absl::Status& status) {
  v1::ErrorInfo error = ToErrorInfo(status);
  error.set_message(Legible(error.message()));
  for (auto& [name, value] : *error.mutable_metadata()) value = Legible(value, kMostFigureBytes);
  for (v1::Remedy& remedy : *error.mutable_remedies()) {
    remedy.set_value(Legible(remedy.value(), kMostFigureBytes));
  }
  return error;
}

grpc::Status ToGrpcStatus(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  const std::string message = Legible(std::string(status.message()));
  v1::StatusDetails details;
  details.set_code(static_cast<int>(status.code()));
  details.set_message(message);
  details.add_details()->PackFrom(ToLegibleErrorInfo(status));
  // absl and gRPC use the same numbers for the same codes.
  return {static_cast<grpc::StatusCode>(status.code()), message, details.SerializeAsString()};
}

}  // namespace carillon
