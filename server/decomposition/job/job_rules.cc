// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job/job_rules.h"

#include <algorithm>
#include <array>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "server/decomposition/job/decomposition_request.h"

namespace carillon {
namespace {

template <size_t N>
bool IsOneOf(const std::string& reason, const std::array<const char*, N>& reasons) {
  return std::ranges::find(reasons, reason) != reasons.end();
}

v1::ErrorInfo JobCancelled() {
  return ToErrorInfo(Refusal(absl::StatusCode::kCancelled, "JOB_CANCELLED",
                             "a caller cancelled the job: create the model again"));
}

}  // namespace

v1::JobKind KindOf(const JobRecord& record) {
  return record.transfer_of.empty() ? v1::JOB_KIND_DECOMPOSITION : v1::JOB_KIND_TRANSFER;
}

v1::Job ToJob(const JobRecord& record) {
  v1::Job job;
  job.set_name(absl::StrCat("jobs/", record.digest));
  const bool radiates = !record.transfer_of.empty();
  job.set_modal_model(absl::StrCat("modalModels/", radiates ? record.transfer_of : record.digest));
  job.set_kind(KindOf(record));
  job.set_state(record.state);
  if (record.state == v1::JOB_STATE_FAILED) *job.mutable_error() = record.error;
  if (record.state == v1::JOB_STATE_CANCELLED) *job.mutable_error() = JobCancelled();
  job.set_label(record.label);
  job.set_priority(record.priority);
  job.set_way(record.way);
  job.set_memory_bytes(record.peak_bytes);
  job.set_created_unix_ms(record.created_unix_ms);
  return job;
}

JobRecord NewRecord(const WantedJob& wanted, int64_t now_unix_ms) {
  return {.digest = wanted.digest,
          .transfer_of = wanted.transfer_of,
          .request = wanted.request.SerializeAsString(),
          .label = wanted.request.label(),
          .state = v1::JOB_STATE_QUEUED,
          .created_unix_ms = now_unix_ms,
          .priority = wanted.request.priority()};
}

absl::StatusOr<v1::CreateModalModelRequest> ParseRequest(const JobRecord& record) {
  v1::CreateModalModelRequest request;
  if (!record.damaged && request.ParseFromString(record.request)) return request;
  return Refusal(absl::StatusCode::kDataLoss, "DATABASE_CORRUPT",
                 absl::StrCat("jobs/", record.digest, " cannot be read: create its model again"));
}

bool StatesUnit(const v1::CreateModalModelRequest& request) {
  return request.settings().metres_per_unit() > 0;
}

bool SameHints(const v1::CreateModalModelRequest& a, const v1::CreateModalModelRequest& b) {
  return LeavesBandOpen(a) == LeavesBandOpen(b) && WantedEigenvalue(a) == WantedEigenvalue(b) &&
         UnitEigenvalue(a, a.min_frequency_hz()) == UnitEigenvalue(b, b.min_frequency_hz());
}

bool WantsMore(const v1::CreateModalModelRequest& a, const v1::CreateModalModelRequest& b) {
  const double wanted = WantedEigenvalue(a);
  const double other = WantedEigenvalue(b);
  return wanted > other || (wanted == other && ((!LeavesBandOpen(a) && LeavesBandOpen(b)) ||
                                                (StatesUnit(a) && !StatesUnit(b))));
}

bool DependsOnHints(const std::string& reason) {
  return IsOneOf<4>(
      reason, {"NO_MODE_IN_BAND", "TOO_MANY_MODES", "VERIFICATION_FAILED", "MESH_UNIT_UNCLEAR"});
}

bool WouldFailAgain(const JobRecord& record, const v1::CreateModalModelRequest& request) {
  if (record.state != v1::JOB_STATE_FAILED || !record.remembered) return false;
  const auto refused = ParseRequest(record);
  if (!DependsOnHints(record.error.reason())) return true;
  return refused.ok() && SameHints(*refused, request) &&
         StatesUnit(*refused) == StatesUnit(request);
}

bool DependsOnWay(const Outcome& outcome) {
  return !outcome.killed &&
         IsOneOf<2>(outcome.error.reason(), {"WORKER_CRASHED", "MESH_TETRAHEDRALIZATION_FAILED"});
}

bool IsDeterministic(const Outcome& outcome) {
  return outcome.verdict == Verdict::kBadInput || DependsOnWay(outcome);
}

Verdict VerdictOfReport(const std::string& reason) {
  if (IsOneOf<2>(reason, {"OUT_OF_MEMORY", "MEMORY_TOO_SMALL"})) return Verdict::kOutOfMemory;
  // These do not depend on the request, so another attempt may succeed.
  if (IsOneOf<4>(reason,
                 {"INTERNAL", "OUTPUT_NOT_WRITABLE", "FILE_NOT_FOUND", "WORKER_NOT_FOUND"})) {
    return Verdict::kCrashed;
  }
  return Verdict::kBadInput;
}

v1::JobState StateOf(Verdict verdict) {
  if (verdict == Verdict::kOk) return v1::JOB_STATE_SUCCEEDED;
  return verdict == Verdict::kCancelled ? v1::JOB_STATE_CANCELLED : v1::JOB_STATE_FAILED;
}

bool HasEnded(v1::JobState state) {
  return state == v1::JOB_STATE_SUCCEEDED || state == v1::JOB_STATE_FAILED ||
         state == v1::JOB_STATE_CANCELLED;
}

bool Matches(const v1::Job& job, const JobFilter& filter) {
  const bool in_state = filter.states.empty() || std::ranges::count(filter.states, job.state()) > 0;
  return in_state && absl::StrContains(absl::AsciiStrToLower(job.label()),
                                       absl::AsciiStrToLower(filter.label_contains));
}

v1::ErrorInfo InternalError(absl::string_view reason, absl::string_view message) {
  return ToErrorInfo(Refusal(absl::StatusCode::kInternal, reason, message));
}

v1::ErrorInfo GaveUp(uint32_t start_count) {
  return ToErrorInfo(Refusal(
      absl::StatusCode::kInternal, "DECOMPOSITION_GIVEN_UP",
      absl::StrCat(
          "the daemon was killed ", start_count,
          " times during this decomposition: look for a lack of memory in the system's log, and "
          "create the model again")));
}

}  // namespace carillon
