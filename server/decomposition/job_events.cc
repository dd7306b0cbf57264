// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job_events.h"

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

std::string ModelOf(const JobRecord& job) {
  return absl::StrCat("modalModels/", job.transfer_of.empty() ? job.digest : job.transfer_of);
}

}  // namespace

void JobEvents::LogFailure(const JobRecord& job, const std::string& client) {
  Event event("job_failed", LogLevel::kWarning);
  event.With("job", absl::StrCat("jobs/", job.digest)).With("reason", job.error.reason());
  event.With("message", job.error.message()).WithSome("label", job.label);
  if (!job.transfer_of.empty()) event.With("transfer_of", ModelOf(job));
  failures_.Log(event.WithSome("client", client));
}

void JobEvents::LogModel(const ModelSummary& model) {
  results_.Log(Event("model_stored")
                   .With("model", absl::StrCat("modalModels/", model.digest))
                   .WithSome("label", model.label)
                   .With("modes", model.header.mode_count())
                   .With("bytes", model.stored_bytes));
}

void JobEvents::LogTransfer(const JobRecord& job) {
  results_.Log(Event("transfer_stored")
                   .With("model", ModelOf(job))
                   .WithSome("label", job.label)
                   .With("job", absl::StrCat("jobs/", job.digest)));
}

void JobEvents::LogDeletedResult(const std::string& digest) {
  sink_(Event("model_deleted")
            .With("model", absl::StrCat("modalModels/", digest))
            .With("cause", "deleted_while_stored"));
}

void JobEvents::LogUnstored(const std::string& what, const std::string& digest,
                            const absl::Status& status) {
  if (status.ok()) return;
  unstored_.Log(Event("job_not_stored", LogLevel::kWarning)
                    .With("what", what)
                    .WithSome("job", digest.empty() ? "" : absl::StrCat("jobs/", digest))
                    .With("message", status.message()));
}

}  // namespace carillon
