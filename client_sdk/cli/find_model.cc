// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/find_model.h"

#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

constexpr absl::string_view kModels = "modalModels/";
constexpr absl::string_view kJobs = "jobs/";

/// The words for the kind of thing that is searched for.
struct Wording {
  absl::string_view prefix, not_found, ambiguous, noun;
};

/// Returns the name of the one of `items` that `text` means.
template <class Item>
absl::StatusOr<std::string> Choose(const std::vector<Item>& items, const std::string& text,
                                   const Wording& wording) {
  std::vector<std::string> found;
  for (const Item& item : items) {
    const absl::string_view digest = absl::StripPrefix(item.name(), wording.prefix);
    if (item.label() == text || (!text.empty() && absl::StartsWith(digest, text))) {
      found.push_back(item.name());
    }
  }
  if (found.size() == 1) return found.front();
  if (found.empty()) {
    return Refusal(absl::StatusCode::kNotFound, wording.not_found,
                   absl::StrCat("no ", wording.noun, " has the label or begins with the digits '",
                                text, "'; `carillon model list` shows what there is"));
  }
  return Refusal(absl::StatusCode::kInvalidArgument, wording.ambiguous,
                 absl::StrCat("'", text, "' means ", found.size(), " of the ", wording.noun,
                              "s, for instance ", found[0], " and ", found[1],
                              "; give more digits of the digest"));
}

}  // namespace

absl::StatusOr<std::string> FindModel(const client::Client& daemon, const std::string& text) {
  if (absl::StartsWith(text, kModels)) return text;
  ASSIGN_OR_RETURN(const auto models, daemon.ListModalModels());
  return Choose(models, text, {kModels, "MODAL_MODEL_NOT_FOUND", "MODAL_MODEL_AMBIGUOUS", "model"});
}

absl::StatusOr<std::string> FindJob(const client::Client& daemon, const std::string& text) {
  if (absl::StartsWith(text, kJobs)) return text;
  ASSIGN_OR_RETURN(const auto jobs, daemon.ListJobs());
  return Choose(jobs, std::string(absl::StripPrefix(text, kModels)),
                {kJobs, "JOB_NOT_FOUND", "JOB_AMBIGUOUS", "job"});
}

}  // namespace carillon::cli
