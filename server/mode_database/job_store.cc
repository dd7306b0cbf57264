// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/job_store.h"

#include <iterator>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "proto/error_reason.h"
#include "server/mode_database/database.h"
#include "server/mode_database/page_token.h"

namespace carillon {
namespace {

constexpr char kSelectRows[] =
    "SELECT number, digest, label, state, remembered, created_unix_ms, error, request FROM jobs ";

absl::StatusOr<JobRecord> ParseRow(const SqlRow& row) {
  JobRecord job{.digest = row.Text(1),
                .request = std::string(row.Blob(7)),
                .label = row.Text(2),
                .state = static_cast<v1::JobState>(row.Int(3)),
                .remembered = row.Int(4) != 0,
                .created_unix_ms = row.Int(5)};
  const std::string_view error = row.Blob(6);
  if (!job.error.ParseFromArray(error.data(), static_cast<int>(error.size()))) {
    return Refusal(absl::StatusCode::kDataLoss, "DATABASE_CORRUPT",
                   absl::StrCat("jobs/", job.digest,
                                " cannot be read: delete the model of that name "
                                "and create it again"));
  }
  return job;
}

}  // namespace

absl::Status JobStore::Put(const JobRecord& job) {
  return database_->Write([&](SqliteConnection& connection) {
    return connection.Run(
        "INSERT INTO jobs (digest, label, state, remembered, created_unix_ms, error, request) "
        "VALUES (?, ?, ?, ?, ?, ?, ?) ON CONFLICT (digest) DO UPDATE SET label = excluded.label, "
        "state = excluded.state, remembered = excluded.remembered, "
        "created_unix_ms = excluded.created_unix_ms, error = excluded.error, "
        "request = excluded.request",
        {job.digest, job.label, static_cast<int64_t>(job.state),
         static_cast<int64_t>(job.remembered ? 1 : 0), job.created_unix_ms,
         SqlBlob{job.error.SerializeAsString()}, SqlBlob{job.request}});
  });
}

absl::StatusOr<std::optional<JobRecord>> JobStore::Find(const std::string& digest) {
  std::optional<JobRecord> job;
  const absl::Status status = database_->Read([&](SqliteConnection& connection) {
    return connection.Query(absl::StrCat(kSelectRows, "WHERE digest = ?").c_str(), {digest},
                            [&](const SqlRow& row) {
                              absl::StatusOr<JobRecord> found = ParseRow(row);
                              if (!found.ok()) return found.status();
                              job = *std::move(found);
                              return absl::OkStatus();
                            });
  });
  if (!status.ok()) return status;
  return job;
}

absl::StatusOr<std::vector<JobRecord>> JobStore::Unfinished() {
  std::vector<JobRecord> jobs;
  const absl::Status status = database_->Read([&](SqliteConnection& connection) {
    return connection.Query(
        absl::StrCat(kSelectRows, "WHERE state IN (?, ?) ORDER BY number").c_str(),
        {static_cast<int64_t>(v1::JOB_STATE_QUEUED), static_cast<int64_t>(v1::JOB_STATE_RUNNING)},
        [&](const SqlRow& row) {
          absl::StatusOr<JobRecord> job = ParseRow(row);
          if (!job.ok()) return job.status();
          jobs.push_back(*std::move(job));
          return absl::OkStatus();
        });
  });
  if (!status.ok()) return status;
  return jobs;
}

absl::StatusOr<JobPage> JobStore::List(int page_size, const std::string& page_token) {
  const absl::StatusOr<PageRange> range = ParsePage(page_size, page_token);
  if (!range.ok()) return range.status();
  JobPage page;
  const absl::Status status = database_->Read([&](SqliteConnection& connection) {
    return connection.Query(
        absl::StrCat(kSelectRows, "WHERE number < ? ORDER BY number DESC LIMIT ?").c_str(),
        {range->below, range->size}, [&](const SqlRow& row) {
          absl::StatusOr<JobRecord> job = ParseRow(row);
          if (!job.ok()) return job.status();
          page.next_page_token = absl::StrCat(row.Int(0));
          page.jobs.push_back(*std::move(job));
          return absl::OkStatus();
        });
  });
  if (!status.ok()) return status;
  if (std::ssize(page.jobs) < range->size) page.next_page_token.clear();
  return page;
}

absl::Status JobStore::Delete(const std::string& digest) {
  return database_->Write([&](SqliteConnection& connection) {
    return connection.Run("DELETE FROM jobs WHERE digest = ?", {digest});
  });
}

}  // namespace carillon
