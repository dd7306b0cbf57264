// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/output.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "absl/strings/str_format.h"
#include "client_sdk/cli/message_json.h"
#include "proto/cpp/error_reason.h"

namespace carillon::cli {

int Report(const absl::Status& status, const HasOption& has_option) {
  if (status.ok()) return kDone;
  const v1::ErrorInfo error = ToErrorInfo(status);
  std::string message = InCommandWords(error.message(), has_option);
  std::ranges::replace(message, '\n', ' ');
  absl::FPrintF(stderr, "carillon: %s: %s\n", error.reason(), message);
  for (const v1::Remedy& remedy : error.remedies()) {
    absl::FPrintF(stderr, "carillon: try %s\n", RemedyText(remedy));
  }
  return error.reason() == "SERVER_UNAVAILABLE" ? kNoServer : kRefused;
}

void PrintJson(const google::protobuf::Message& message) {
  absl::PrintF("%s\n", MessageJson(message));
}

std::string Decibels(double amplitude) {
  if (amplitude <= 0) return "silence";
  return absl::StrFormat("%.1f dBFS", 20 * std::log10(amplitude));
}

std::string Loudness(bool present, double lufs) {
  return present ? absl::StrFormat("%.1f LUFS", lufs) : "below -70 LUFS";
}

}  // namespace carillon::cli
