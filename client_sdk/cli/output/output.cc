// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/output/output.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "proto/cpp/error_reason.h"

namespace carillon::cli {

absl::Status FlushOutput() {
  const bool flushed = std::fflush(stdout) == 0;
  const char* const why = flushed ? "an earlier write failed" : std::strerror(errno);
  if (flushed && std::ferror(stdout) == 0) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                 absl::StrCat("stdout: ", why,
                              "; a part of the output is lost: send it to a file or a pipe that "
                              "takes it"));
}

absl::StatusOr<std::string> ReadText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, 65536> piece;
  std::string text;
  while (file.read(piece.data(), piece.size()) || file.gcount() > 0) {
    text.append(piece.data(), static_cast<size_t>(file.gcount()));
  }
  if (file.eof()) return text;  // a folder can be opened, and not read
  return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                 absl::StrCat(path, " cannot be read: see its name and rights"));
}

absl::Status WriteText(const std::string& path, absl::string_view text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (file) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                 absl::StrCat(path, ": ", std::strerror(errno), "; choose another file"));
}

int Report(const absl::Status& status, bool json) {
  if (status.ok()) return kDone;
  const v1::ErrorInfo error = ToErrorInfo(status);
  // `doctor` has printed what does not serve, and one document of JSON is enough.
  if (json && error.reason() != "NOT_SERVING") absl::PrintF("%s\n", ErrorJson(status));
  std::string message = error.message();
  std::ranges::replace(message, '\n', ' ');
  absl::FPrintF(stderr, "carillon: %s: %s\n", error.reason(), message);
  for (const v1::Remedy& remedy : error.remedies()) {
    absl::FPrintF(stderr, "carillon: try %s\n", RemedyText(remedy));
  }
  return error.reason() == "SERVER_UNAVAILABLE" ? kNoServer : kRefused;
}

std::string ErrorJson(const absl::Status& status) {
  return MembersJson({{"error", JsonText{MessageJson(ToErrorInfo(status))}}});
}

void PrintJson(const google::protobuf::Message& message) {
  absl::PrintF("%s\n", MessageJson(message));
}

void PrintJson(const std::vector<JsonMember>& members) {
  absl::PrintF("%s\n", MembersJson(members));
}

void PrintNothing(absl::string_view noun) { absl::FPrintF(stderr, "no %s to show\n", noun); }

std::string Counted(uint64_t count, absl::string_view noun) {
  const char* const ending = count == 1 ? "" : absl::EndsWith(noun, "sh") ? "es" : "s";
  return absl::StrCat(count, " ", noun, ending);
}

std::string Decibels(double amplitude) {
  constexpr double kSilence = 0x1p-24;  // half of the smallest step of 24 bits
  if (amplitude < kSilence) return "silence";
  return absl::StrFormat("%.1f dBFS", 20 * std::log10(amplitude));
}

std::string Loudness(bool present, double lufs) {
  return present ? absl::StrFormat("%.1f LUFS", lufs) : "below -70 LUFS";
}

}  // namespace carillon::cli
