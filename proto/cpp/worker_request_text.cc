// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/worker_request_text.h"

#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/text_format.h>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

using google::protobuf::TextFormat;

/// Remembers the first error of a parser.
class FirstError : public google::protobuf::io::ErrorCollector {
 public:
  void AddError(int line, int column, const std::string& message) override {
    if (!what_.empty()) return;
    what_ = absl::StrCat("line ", line + 1, ", column ", column + 1, ": ", message);
  }
  const std::string& what() const { return what_; }

 private:
  std::string what_;
};

}  // namespace

std::string WorkerRequestText(const worker::v1::WorkerRequest& request) {
  TextFormat::Printer printer;
  printer.SetUseShortRepeatedPrimitives(true);
  std::string text;
  printer.PrintToString(request, &text);
  return text;
}

absl::StatusOr<worker::v1::WorkerRequest> ParseWorkerRequest(absl::string_view text) {
  worker::v1::WorkerRequest request;
  FirstError error;
  TextFormat::Parser parser;
  parser.RecordErrorsTo(&error);
  if (parser.ParseFromString(std::string(text), &request)) return request;
  return Refusal(
      absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
      absl::StrCat("the request cannot be read: ", error.what(),
                   "; write carillon.v1.WorkerRequest in protobuf's text form, and give the daemon "
                   "and carillon-precompute one version"));
}

}  // namespace carillon
