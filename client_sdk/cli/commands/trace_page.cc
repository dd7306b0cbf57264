// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/trace_page.h"

#include <unistd.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "carillon/contact_trace.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/commands/find_model.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/child_process.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

constexpr size_t kMostPageBytes = 16U << 20U;

/// Returns the page without a trace.
absl::StatusOr<std::string> EmptyPage() {
  const std::string program = PathOfCompanion("carillon-console");
  ASSIGN_OR_RETURN(Pipe output, Pipe::Make());
  absl::StatusOr<ChildProcess> child = ChildProcess::Start(
      {.words = {program, "--trace-page"}, .output = output.write_end(), .errors = STDERR_FILENO});
  output.CloseWriteEnd();
  std::string page;
  if (child.ok()) {
    page = output.Read(kMostPageBytes);
    child->Wait();
  }
  if (!page.empty()) return page;
  return Refusal(absl::StatusCode::kAborted, "PROGRAM_ENDED",
                 absl::StrCat(program,
                              " gave no page: install the package carillon-console, of "
                              "the version of this program, or leave --html out"));
}

absl::StatusOr<std::string> Base64OfFile(const std::string& path) {
  ASSIGN_OR_RETURN(const std::string bytes, ReadText(path));
  return absl::Base64Escape(bytes);
}

template <typename T>
std::string Base64Of(const std::vector<T>& numbers) {
  return absl::Base64Escape(
      absl::string_view(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T)));
}

/// Returns the surfaces of the trace's models as members of a JSON object.
absl::StatusOr<std::string> SurfacesOf(const client::Client& daemon, const std::string& path) {
  std::string members;
  std::set<std::string> names;
  ASSIGN_OR_RETURN(client::ContactTraceReader trace, client::ContactTraceReader::Open(path));
  while (true) {
    ASSIGN_OR_RETURN(const std::optional<v1::ContactTraceRecord> record, trace.Next());
    if (!record) return members;
    const std::string& name = record->object().modal_model();
    if (name.empty() || !names.insert(name).second) continue;
    ASSIGN_OR_RETURN(const interchange::StoredModel model, Fetch(daemon, name));
    absl::StrAppend(&members, members.empty() ? "" : ",", "\"", name, R"(":{"vertices":")",
                    Base64Of(model.vertices), R"(","triangles":")", Base64Of(model.triangles),
                    R"("})");
  }
}

}  // namespace

absl::Status WriteTracePage(const client::Client& daemon, const RenderedTrace& rendered,
                            const std::string& path) {
  ASSIGN_OR_RETURN(const std::string page, EmptyPage());
  ASSIGN_OR_RETURN(const std::string contacts, Base64OfFile(rendered.trace));
  ASSIGN_OR_RETURN(const std::string wave, Base64OfFile(rendered.wave));
  ASSIGN_OR_RETURN(const std::string surfaces, SurfacesOf(daemon, rendered.trace));
  const std::string name = std::filesystem::path(rendered.trace).filename().string();
  // Base64 has no character that JSON or HTML would have to escape.
  const std::string text = absl::StrCat(
      R"({"name":")", absl::Base64Escape(name), R"(","contacts":")", contacts, R"(","wave":")",
      wave, R"(","blows":")", absl::Base64Escape(rendered.blows.SerializeAsString()),
      R"(","summary":")", absl::Base64Escape(rendered.summary.SerializeAsString()),
      R"(","surfaces":{)", surfaces, "}}");
  return WriteText(path, absl::StrCat(page, "<script type=\"application/json\" id=\"trace\">", text,
                                      "</script>\n"));
}

}  // namespace carillon::cli
