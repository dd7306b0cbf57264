// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/error_reason.h"

#include <algorithm>
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "proto/cpp/shortest_decimal.h"

namespace carillon {
namespace {

constexpr absl::string_view kFigurePrefix = "carillon.figure/";
/// Its value is an ErrorInfo with nothing but remedies.
constexpr absl::string_view kRemedies = "carillon.remedies";

bool IsReason(absl::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](unsigned char c) {
    return absl::ascii_isupper(c) || absl::ascii_isdigit(c) || c == '_';
  });
}

}  // namespace

absl::Status Refusal(absl::StatusCode code, absl::string_view reason, absl::string_view message) {
  return absl::Status(code, absl::StrCat(reason, ": ", message));
}

void AddFigure(absl::Status& status, absl::string_view name, absl::string_view value) {
  status.SetPayload(absl::StrCat(kFigurePrefix, name), absl::Cord(value));
}

void AddRemedy(absl::Status& status, const v1::Remedy& remedy) {
  v1::ErrorInfo remedies;
  if (const auto before = status.GetPayload(kRemedies)) {
    remedies.ParseFromString(std::string(*before));
  }
  *remedies.add_remedies() = remedy;
  status.SetPayload(kRemedies, absl::Cord(remedies.SerializeAsString()));
}

std::string RemedyText(const v1::Remedy& remedy) {
  const bool flag = remedy.value().empty() || remedy.value() == "true";
  return absl::StrCat(remedy.option(), flag ? "" : " ", flag ? "" : remedy.value(), ": ",
                      remedy.effect());
}

v1::ErrorInfo ToErrorInfo(const absl::Status& status) {
  v1::ErrorInfo error;
  const absl::string_view message = status.message();
  const size_t colon = message.find(": ");
  if (colon != absl::string_view::npos && IsReason(message.substr(0, colon))) {
    error.set_reason(std::string(message.substr(0, colon)));
    error.set_message(std::string(message.substr(colon + 2)));
  } else {
    error.set_reason("INTERNAL");
    error.set_message(std::string(message));
  }
  if (const auto remedies = status.GetPayload(kRemedies)) {
    error.MergeFromString(std::string(*remedies));
  }
  status.ForEachPayload([&](absl::string_view url, const absl::Cord& value) {
    if (absl::ConsumePrefix(&url, kFigurePrefix)) {
      (*error.mutable_metadata())[std::string(url)] = std::string(value);
    }
  });
  return error;
}

absl::Status About(absl::string_view about, absl::string_view figure, absl::string_view value,
                   const absl::Status& status) {
  v1::ErrorInfo error = ToErrorInfo(status);
  error.set_message(absl::StrCat(about, ": ", error.message()));
  (*error.mutable_metadata())[std::string(figure)] = std::string(value);
  return FromErrorInfo(status.code(), error);
}

absl::Status AtElement(const absl::Status& status, absl::string_view list, size_t index) {
  return About(absl::StrCat(list, "[", index, "]"), "index", absl::StrCat(index), status);
}

absl::Status AtTime(const absl::Status& status, double time_s) {
  const std::string time = ShortestDecimal(time_s);
  return About(absl::StrCat("at ", time, " s"), "time_s", time, status);
}

absl::Status FromErrorInfo(absl::StatusCode code, const v1::ErrorInfo& error) {
  absl::Status status = Refusal(code, error.reason(), error.message());
  for (const auto& [name, value] : error.metadata()) AddFigure(status, name, value);
  for (const v1::Remedy& remedy : error.remedies()) AddRemedy(status, remedy);
  return status;
}

}  // namespace carillon
