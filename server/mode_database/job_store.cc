// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/job_store.h"

#include <bit>
#include <iterator>
#include <string_view>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/base/xxh3.h"
#include "server/mode_database/database.h"
#include "server/mode_database/page_token.h"

namespace carillon {
namespace {

constexpr char kSelectJobs[] =
    "SELECT number, digest, label, state, remembered, created_unix_ms, priority, start_count, way, "
    "peak_bytes, xxh3 IS NULL, xxh3, error, request, transfer_of FROM jobs ";

// The hash covers every column, so that no bit of a job can change unnoticed.
int64_t RowHash(const JobRecord& job, std::string_view error) {
  std::string text =
      absl::StrCat(job.digest, " ", static_cast<int>(job.state), " ", job.remembered ? 1 : 0, " ",
                   job.created_unix_ms, " ", job.priority, " ", job.start_count, " ", job.way, " ",
                   job.peak_bytes, " ", job.label.size(), " ", error.size(), " ");
  text.append(job.label).append(error).append(job.request).append(job.transfer_of);
  return std::bit_cast<int64_t>(Xxh3(text));
}

JobRecord Damaged(const JobRecord& job) {
  JobRecord damaged{.digest = job.digest,
                    .label = job.label,
                    .state = v1::JOB_STATE_FAILED,
                    .created_unix_ms = job.created_unix_ms,
                    .damaged = true};
  damaged.error = ToErrorInfo(Refusal(
      absl::StatusCode::kDataLoss, "DATABASE_CORRUPT",
      absl::StrCat("jobs/", job.digest,
                   " has changed on the disk: create its model again, and check the disk")));
  return damaged;
}

JobRecord ParseJob(const SqlRow& row) {
  JobRecord job{.digest = row.Text(1),
                .transfer_of = row.Text(14),
                .request = std::string(row.Blob(13)),
                .label = row.Text(2),
                .state = static_cast<v1::JobState>(row.Int(3)),
                .remembered = row.Int(4) != 0,
                .created_unix_ms = row.Int(5),
                .priority = static_cast<int32_t>(row.Int(6)),
                .start_count = static_cast<uint32_t>(row.Int(7)),
                .way = static_cast<uint32_t>(row.Int(8)),
                .peak_bytes = static_cast<uint64_t>(row.Int(9))};
  const std::string_view error = row.Blob(12);
  const bool hashed = row.Int(10) == 0;
  if ((hashed && RowHash(job, error) != row.Int(11)) ||
      !job.error.ParseFromArray(error.data(), static_cast<int>(error.size()))) {
    return Damaged(job);
  }
  return job;
}

/// The condition that a job is in one of the states.
std::string StatesAre(const std::vector<v1::JobState>& states) {
  if (states.empty()) return "";
  return absl::StrCat("AND state IN (",
                      absl::StrJoin(states, ",",
                                    [](std::string* out, auto state) {
                                      absl::StrAppend(out, static_cast<int>(state));
                                    }),
                      ") ");
}

constexpr char kAddClient[] =
    "INSERT OR IGNORE INTO job_clients (digest, client) SELECT digest, ? FROM jobs WHERE digest = "
    "?";
constexpr char kForgetClients[] = "DELETE FROM job_clients WHERE digest = ?";

absl::Status PutRow(SqliteConnection& connection, const JobRecord& job) {
  const std::string error = job.error.SerializeAsString();
  return connection.Run(
      "INSERT INTO jobs (digest, label, state, remembered, created_unix_ms, priority, "
      "start_count, way, peak_bytes, xxh3, error, request, transfer_of) "
      "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (digest) DO UPDATE SET "
      "label = excluded.label, state = excluded.state, remembered = excluded.remembered, "
      "created_unix_ms = excluded.created_unix_ms, priority = excluded.priority, "
      "start_count = excluded.start_count, way = excluded.way, "
      "peak_bytes = excluded.peak_bytes, xxh3 = excluded.xxh3, error = excluded.error, "
      "request = excluded.request, transfer_of = excluded.transfer_of",
      {job.digest, job.label, static_cast<int64_t>(job.state),
       static_cast<int64_t>(job.remembered ? 1 : 0), job.created_unix_ms,
       static_cast<int64_t>(job.priority), static_cast<int64_t>(job.start_count),
       static_cast<int64_t>(job.way), static_cast<int64_t>(job.peak_bytes), RowHash(job, error),
       SqlBlob{error}, SqlBlob{job.request}, job.transfer_of});
}

}  // namespace

absl::Status JobStore::Put(const JobRecord& job, const std::vector<std::string>& clients) {
  const bool has_ended = job.state != v1::JOB_STATE_QUEUED && job.state != v1::JOB_STATE_RUNNING;
  return database_->Write([&](SqliteConnection& connection) {
    RETURN_IF_ERROR(PutRow(connection, job));
    if (has_ended) return connection.Run(kForgetClients, {job.digest});
    for (const std::string& client : clients) {
      if (client.empty()) continue;
      RETURN_IF_ERROR(connection.Run(kAddClient, {client, job.digest}));
    }
    return absl::OkStatus();
  });
}

absl::Status JobStore::AddClient(const std::string& digest, const std::string& client) {
  return database_->Write([&](SqliteConnection& connection) {
    return connection.Run(kAddClient, {client, digest});
  });
}

absl::Status JobStore::RemoveClient(const std::string& digest, const std::string& client) {
  return database_->WriteToFree([&](SqliteConnection& connection) {
    return connection.Run("DELETE FROM job_clients WHERE digest = ? AND client = ?",
                          {digest, client});
  });
}

absl::StatusOr<std::vector<std::string>> JobStore::Clients(const std::string& digest) {
  std::vector<std::string> clients;
  RETURN_IF_ERROR(database_->Read([&](SqliteConnection& connection) {
    return connection.Query("SELECT client FROM job_clients WHERE digest = ?", {digest},
                            [&](const SqlRow& row) {
                              clients.push_back(row.Text(0));
                              return absl::OkStatus();
                            });
  }));
  return clients;
}

absl::StatusOr<std::optional<JobRecord>> JobStore::Find(const std::string& digest) {
  std::optional<JobRecord> job;
  RETURN_IF_ERROR(database_->Read([&](SqliteConnection& connection) {
    return connection.Query(absl::StrCat(kSelectJobs, "WHERE digest = ?").c_str(), {digest},
                            [&](const SqlRow& row) {
                              job = ParseJob(row);
                              return absl::OkStatus();
                            });
  }));
  return job;
}

absl::StatusOr<std::vector<JobRecord>> JobStore::Unfinished() {
  std::vector<JobRecord> jobs;
  RETURN_IF_ERROR(database_->Read([&](SqliteConnection& connection) {
    // Every row is read, because a state that has changed on the disk would hide its job.
    return connection.Query(absl::StrCat(kSelectJobs, "ORDER BY number").c_str(), {},
                            [&](const SqlRow& row) {
                              JobRecord job = ParseJob(row);
                              if (job.damaged || job.state == v1::JOB_STATE_QUEUED ||
                                  job.state == v1::JOB_STATE_RUNNING) {
                                jobs.push_back(std::move(job));
                              }
                              return absl::OkStatus();
                            });
  }));
  return jobs;
}

absl::StatusOr<JobPage> JobStore::List(int page_size, const std::string& page_token,
                                       const JobFilter& filter) {
  ASSIGN_OR_RETURN(const PageRange range, ParsePage("jobs", page_size, page_token));
  JobPage page;
  RETURN_IF_ERROR(database_->Read([&](SqliteConnection& connection) {
    return connection.Query(
        absl::StrCat(kSelectJobs, "WHERE number < ?1 ", StatesAre(filter.states),
                     "AND (?2 = '' OR instr(lower(label), lower(?2)) > 0) "
                     "ORDER BY number DESC LIMIT ?3")
            .c_str(),
        {range.below, filter.label_contains, range.size}, [&](const SqlRow& row) {
          page.next_page_token = PageToken("jobs", row.Int(0));
          page.jobs.push_back(ParseJob(row));
          return absl::OkStatus();
        });
  }));
  if (std::ssize(page.jobs) < range.size) page.next_page_token.clear();
  return page;
}

absl::Status JobStore::Delete(const std::string& digest) {
  return database_->Write([&](SqliteConnection& connection) {
    return connection.Run("DELETE FROM jobs WHERE digest = ?", {digest});
  });
}

absl::StatusOr<std::optional<std::string>> JobStore::Fact(const std::string& name) {
  std::optional<std::string> value;
  RETURN_IF_ERROR(database_->Read([&](SqliteConnection& connection) {
    return connection.Query("SELECT value FROM facts WHERE name = ?", {name},
                            [&](const SqlRow& row) {
                              value = row.Text(0);
                              return absl::OkStatus();
                            });
  }));
  return value;
}

absl::Status JobStore::PutFact(const std::string& name, const std::string& value) {
  return database_->Write([&](SqliteConnection& connection) {
    return connection.Run("INSERT OR REPLACE INTO facts (name, value) VALUES (?, ?)",
                          {name, value});
  });
}

}  // namespace carillon
