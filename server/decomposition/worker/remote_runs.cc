// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker/remote_runs.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/base/sha256.h"
#include "server/decomposition/worker/random_digits.h"
#include "server/decomposition/worker/worker_events.h"
#include "server/mode_database/codec/model_checker.h"
#include "server/mode_database/codec/model_codec.h"
#include "server/mode_database/codec/transfer_codec.h"

namespace carillon {
namespace {

constexpr int kTokenWords = 8;  // of 32 bits

absl::Status Expired(const std::string& digest, absl::string_view why) {
  return Refusal(absl::StatusCode::kFailedPrecondition, "JOB_TOKEN_EXPIRED",
                 absl::StrCat("jobs/", digest, " ", why, ": the result of this run is not wanted"));
}

absl::Status Used(const std::string& digest) {
  return Refusal(absl::StatusCode::kFailedPrecondition, "JOB_TOKEN_EXPIRED",
                 absl::StrCat("a run of jobs/", digest,
                              " has brought its result with this token: the first one counts"));
}

absl::Status NotWritable(const std::filesystem::path& file) {
  return Refusal(absl::StatusCode::kResourceExhausted, "DATABASE_FULL",
                 absl::StrCat("the result of a run cannot be written to ", file.string(),
                              ": free space there"));
}

/// Writes the content of a file or a folder to the disk.
bool Sync(const std::filesystem::path& path) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool synced = fsync(descriptor) == 0;
  close(descriptor);
  return synced;
}

bool Write(const std::filesystem::path& file, const std::string& content) {
  std::ofstream out(file, std::ios::binary);
  out << content;
  out.close();
  return !out.fail();
}

}  // namespace

struct RunUpload::State {
  State(RemoteRuns& of, std::string of_digest, std::string of_token,
        std::filesystem::path of_folder)
      : runs(of),
        digest(std::move(of_digest)),
        token(std::move(of_token)),
        folder(std::move(of_folder)) {}

  RemoteRuns& runs;
  std::string digest;
  std::string token;
  std::filesystem::path folder;
  std::string run = RandomDigits(2);
  ModelChecker checker{};
  std::ofstream model{};
  bool is_transfer = false;
  bool kept = false;

  std::filesystem::path File(absl::string_view kind) const {
    return folder / absl::StrCat(kind, ".", run);
  }

  ~State() {
    std::error_code ignored;
    for (const char* kind : {"model", "events", "ending"}) {
      if (!kept) std::filesystem::remove(File(kind), ignored);
    }
  }
};

RunUpload::RunUpload(std::unique_ptr<State> state) : state_(std::move(state)) {}
RunUpload::RunUpload(RunUpload&&) noexcept = default;
RunUpload& RunUpload::operator=(RunUpload&&) noexcept = default;
RunUpload::~RunUpload() = default;

absl::Status RunUpload::Append(const v1::ModalModelRecord& record) {
  RETURN_IF_ERROR(state_->checker.Check(record));
  return WriteResult(Delimited(record));
}

absl::Status RunUpload::Append(const v1::TransferRecord& record) {
  state_->is_transfer = true;
  return WriteResult(Delimited(record));
}

absl::Status RunUpload::WriteResult(const std::string& bytes) {
  const std::filesystem::path file = state_->File("model");
  if (!state_->model.is_open()) state_->model.open(file, std::ios::binary);
  state_->model << bytes;
  return state_->model ? absl::OkStatus() : NotWritable(file);
}

absl::Status RunUpload::CheckWhole() const {
  state_->model.close();
  return state_->is_transfer ? StoredTransfer::ReadFile(state_->File("model")).status()
                             : state_->checker.Finish();
}

absl::Status RunUpload::Finish(const worker::v1::RunEnd& end) {
  if (end.exit_status() == 0 && !end.has_error()) {
    RETURN_IF_ERROR(CheckWhole());
    if (!state_->model || !Sync(state_->File("model"))) return NotWritable(state_->File("model"));
  }
  worker::v1::WorkerEvent event;
  if (end.has_error()) *event.mutable_error() = end.error();
  const std::string events = end.has_error() ? Delimited(event) : "";
  const std::filesystem::path ending = state_->File("ending");
  if (!Write(state_->File("events"), events) || !Sync(state_->File("events")) ||
      !Write(ending, absl::StrCat(state_->run, " ", end.exit_status(), "\n")) || !Sync(ending)) {
    return NotWritable(ending);
  }
  const MutexLock lock(&state_->runs.mutex_);
  ASSIGN_OR_RETURN(const auto folder, state_->runs.FolderOf(state_->digest, state_->token));
  // The link can be made once, so one of several runs ends the job.
  if (link(ending.c_str(), (folder / "end").c_str()) != 0) {
    return errno == EEXIST ? Used(state_->digest) : NotWritable(folder / "end");
  }
  state_->kept = true;
  Sync(folder);
  return absl::OkStatus();
}

std::string RemoteRuns::NewToken() { return RandomDigits(kTokenWords); }

std::string RemoteRuns::HashOf(const std::string& digest, const std::string& token) {
  return Sha256Hex(absl::StrCat(digest, " ", token));
}

void RemoteRuns::Admit(const std::string& digest, const std::filesystem::path& folder,
                       const std::string& token_hash) {
  const MutexLock lock(&mutex_);
  Place& place = places_[digest];
  place.folder = folder;
  if (place.token_hash == token_hash) return;
  if (!place.token_hash.empty()) place.past_hashes.insert(place.token_hash);
  place.token_hash = token_hash;
}

void RemoteRuns::Dismiss(const std::string& digest) {
  const MutexLock lock(&mutex_);
  places_.erase(digest);
}

absl::StatusOr<std::filesystem::path> RemoteRuns::FolderOf(const std::string& digest,
                                                           const std::string& token) {
  const auto found = places_.find(digest);
  if (found == places_.end()) return Expired(digest, "does not run (any more)");
  const Place& place = found->second;
  const std::string hash = HashOf(digest, token);
  if (place.past_hashes.contains(hash)) return Expired(digest, "was started anew");
  if (hash != place.token_hash) {
    return Refusal(absl::StatusCode::kPermissionDenied, "JOB_TOKEN_WRONG",
                   absl::StrCat("this is not the token of a run of jobs/", digest,
                                ": show the one in its batch script"));
  }
  std::error_code ignored;
  if (std::filesystem::exists(place.folder / "end", ignored)) return Used(digest);
  return place.folder;
}

absl::StatusOr<std::filesystem::path> RemoteRuns::Begin(const std::string& digest,
                                                        const std::string& token) {
  const MutexLock lock(&mutex_);
  ASSIGN_OR_RETURN(const auto folder, FolderOf(digest, token));
  const std::filesystem::path begun = folder / absl::StrCat("begun.", RandomDigits(2));
  if (!Write(begun, "")) return NotWritable(begun);
  return folder / "mesh";
}

absl::Status RemoteRuns::Report(const std::string& digest, const std::string& token,
                                const v1::Progress& progress) {
  worker::v1::WorkerEvent event;
  *event.mutable_progress() = progress;
  const MutexLock lock(&mutex_);
  ASSIGN_OR_RETURN(const auto folder, FolderOf(digest, token));
  // A rename, so that a reader never finds half of the content.
  const std::filesystem::path written = folder / "reported";
  std::error_code error;
  if (Write(written, Delimited(event))) {
    std::filesystem::rename(written, folder / "events.reported", error);
    if (!error) return absl::OkStatus();
  }
  return NotWritable(written);
}

absl::StatusOr<RunUpload> RemoteRuns::BeginUpload(const std::string& digest,
                                                  const std::string& token) {
  const MutexLock lock(&mutex_);
  ASSIGN_OR_RETURN(auto folder, FolderOf(digest, token));
  return RunUpload(std::make_unique<RunUpload::State>(*this, digest, token, folder));
}

}  // namespace carillon
