// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/find_model.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/strip.h"
#include "client_sdk/cli/output/job_progress.h"
#include "client_sdk/interchange/model_records.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/limits.h"
#include "proto/cpp/near_names.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

constexpr absl::string_view kModels = "modalModels/";
constexpr absl::string_view kJobs = "jobs/";
constexpr size_t kShortDigest = 12;
constexpr size_t kMostNamed = 4;

/// The words for the kind of thing that is searched for.
struct Wording {
  absl::string_view prefix, not_found, ambiguous, noun;
};

template <class Item>
bool Means(const std::string& text, const Item& item, absl::string_view prefix) {
  const absl::string_view digest = absl::StripPrefix(item.name(), prefix);
  return item.label() == text || (!text.empty() && absl::StartsWith(digest, text));
}

/// Returns the first digits of the digests of some of the names, and how many more there are.
std::string ShortNames(const std::vector<std::string>& names, absl::string_view prefix) {
  std::vector<absl::string_view> digests;
  for (size_t i = 0; i < std::min(names.size(), kMostNamed); ++i) {
    digests.push_back(absl::StripPrefix(names[i], prefix).substr(0, kShortDigest));
  }
  const std::string shown = absl::StrJoin(digests, ", ");
  return names.size() > kMostNamed
             ? absl::StrCat(shown, " and ", names.size() - kMostNamed, " more")
             : shown;
}

/// Returns "did you mean 'bell'? " if labels are near to the text, and nothing otherwise.
template <class Item>
std::string NearLabels(const std::vector<Item>& items, const std::string& text) {
  std::set<std::string> labels;
  for (const Item& item : items) {
    if (!item.label().empty()) labels.insert(item.label());
  }
  std::vector<std::string> near =
      NearNames(text, std::vector<std::string>(labels.begin(), labels.end()));
  if (near.empty()) return "";
  if (near.size() > kMostNamed) near.resize(kMostNamed);
  for (std::string& label : near) label = EscapedText(label);
  return absl::StrCat("did you mean '", absl::StrJoin(near, "' or '"), "'? ");
}

/// Returns the name of the one of `items` that `text` means.
template <class Item>
absl::StatusOr<std::string> Choose(const std::vector<Item>& items, const std::string& text,
                                   const Wording& wording) {
  std::vector<std::string> found;
  for (const Item& item : items) {
    if (Means(text, item, wording.prefix)) found.push_back(item.name());
  }
  if (found.size() == 1) return found.front();
  if (found.empty()) {
    return Refusal(absl::StatusCode::kNotFound, wording.not_found,
                   absl::StrCat("no ", wording.noun, " has the label or begins with the digits '",
                                text, "'; ", NearLabels(items, text), "`carillon ", wording.noun,
                                " list` shows what there is"));
  }
  return Refusal(absl::StatusCode::kInvalidArgument, wording.ambiguous,
                 absl::StrCat("'", text, "' means ", found.size(), " of the ", wording.noun,
                              "s: ", ShortNames(found, wording.prefix),
                              "; give one of these digests instead"));
}

/// Says what has become of the job whose model is not there, and what to do.
absl::Status NotMade(const std::string& text, const v1::Job& job) {
  const std::string digest(absl::StripPrefix(job.name(), kJobs).substr(0, 12));
  const bool queued = job.state() == v1::JOB_STATE_QUEUED;
  std::string why;
  if (queued || job.state() == v1::JOB_STATE_RUNNING) {
    why = absl::StrCat("its job ", queued ? "is queued" : "is running", " (",
                       absl::StripLeadingAsciiWhitespace(ProgressText(job)),
                       "): `carillon job watch ", digest,
                       "` waits for it, as `carillon model create --wait` does, and ",
                       "`carillon job show ", digest, "` shows its state");
  } else if (job.state() == v1::JOB_STATE_FAILED) {
    why = absl::StrCat("its job failed (", job.error().reason(), ": ", job.error().message(),
                       "): repair that, and call `carillon model create` again; `carillon job "
                       "show ",
                       digest, "` shows the job");
  } else {
    why = "its job was cancelled: call `carillon model create` again";
  }
  absl::Status error = Refusal(absl::StatusCode::kNotFound, "MODAL_MODEL_NOT_FOUND",
                               absl::StrCat("the model '", text, "' is not there, because ", why));
  AddFigure(error, "job", job.name());
  AddFigure(error, "job_state", v1::JobState_Name(job.state()));
  if (!job.error().reason().empty()) AddFigure(error, "job_reason", job.error().reason());
  return error;
}

/// Returns `not_found`, or the state of the newest job that has not made the model.
absl::Status WhyNotFound(const client::Client& daemon, const std::string& text,
                         const absl::Status& not_found) {
  const auto jobs = daemon.ListJobs();
  if (!jobs.ok()) return not_found;
  const std::string digest(absl::StripPrefix(text, kModels));
  const auto job = std::ranges::find_if(*jobs, [&](const v1::Job& item) {
    // The job of a transfer has another digest than its model.
    const bool makes_model =
        absl::StripPrefix(item.name(), kJobs) == absl::StripPrefix(item.modal_model(), kModels);
    return makes_model && Means(digest, item, kJobs);
  });
  if (job == jobs->end() || job->state() == v1::JOB_STATE_SUCCEEDED) return not_found;
  return NotMade(text, *job);
}

}  // namespace

absl::StatusOr<std::string> FindModel(const client::Client& daemon, const std::string& text) {
  if (absl::StartsWith(text, kModels)) {
    // Other errors, such as that of a damaged model, do not keep a command from deleting it.
    const absl::Status shown = daemon.GetModalModel(text).status();
    if (!absl::IsNotFound(shown)) return text;
    return WhyNotFound(daemon, text, shown);
  }
  ASSIGN_OR_RETURN(const auto models, daemon.ListModalModels());
  auto found = Choose(models, text, {kModels, "MODAL_MODEL_NOT_FOUND", "NAME_AMBIGUOUS", "model"});
  return absl::IsNotFound(found.status()) ? WhyNotFound(daemon, text, found.status()) : found;
}

absl::StatusOr<v1::ModalModelSummary> FindSummary(const client::Client& daemon,
                                                  const std::string& text) {
  ASSIGN_OR_RETURN(const std::string name, FindModel(daemon, text));
  return daemon.GetModalModel(name);
}

absl::StatusOr<interchange::StoredModel> Fetch(const client::Client& daemon,
                                               const std::string& name) {
  interchange::ModelAssembler assembler;
  RETURN_IF_ERROR(daemon.ExportModalModel(
      name, [&](const v1::ModalModelRecord& record) { return assembler.Append(record); }));
  return assembler.Finish();
}

std::string SharedLabel(const client::Client& daemon, const v1::ModalModelSummary& model) {
  if (model.label().empty()) return "";
  v1::ListModalModelsRequest filter;
  filter.set_label_contains(model.label());
  const auto models = daemon.ListModalModels(filter);
  if (!models.ok()) return "";
  std::vector<std::string> others;
  for (const v1::ModalModelSummary& item : *models) {
    if (item.label() == model.label() && item.name() != model.name()) others.push_back(item.name());
  }
  if (others.empty()) return "";
  return absl::StrCat("the label '", EscapedText(model.label()), "' now means ", others.size() + 1,
                      " models: name this one ", ShortNames({model.name()}, kModels),
                      " and the other", others.size() > 1 ? "s " : " ", ShortNames(others, kModels),
                      ", or give this one another label by `carillon model tag --label`");
}

std::string OtherLabel(const v1::ModalModelSummary& model, const std::string& wanted) {
  if (model.label() == wanted || wanted.size() > kMaxLabelBytes) return "";
  return absl::StrCat(
      "the model of this body is known as '", model.label(), "' and keeps this label, so that '",
      wanted,
      "' does not name it; an object that names no material now gets the material of "
      "this request: give --material to strike and the like");
}

absl::StatusOr<std::string> FindJob(const client::Client& daemon, const std::string& text) {
  if (absl::StartsWith(text, kJobs)) return text;
  ASSIGN_OR_RETURN(const auto jobs, daemon.ListJobs());
  const std::string wanted(absl::StripPrefix(text, kModels));
  const Wording wording{kJobs, "JOB_NOT_FOUND", "NAME_AMBIGUOUS", "job"};
  // A label means the job that has not ended rather than those that have.
  std::vector<v1::Job> active;
  std::ranges::copy_if(jobs, std::back_inserter(active), [](const v1::Job& job) {
    return job.state() == v1::JOB_STATE_QUEUED || job.state() == v1::JOB_STATE_RUNNING;
  });
  auto found = Choose(active, wanted, wording);
  return absl::IsNotFound(found.status()) ? Choose(jobs, wanted, wording) : found;
}

}  // namespace carillon::cli
