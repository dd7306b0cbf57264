// SPDX-License-Identifier: Apache-2.0
//
// `carillon model create FILE...`
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/commands/find_model.h"
#include "client_sdk/cli/commands/mode_sound.h"
#include "client_sdk/cli/output/job_progress.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/mesh_file.h"
#include "proto/cpp/mesh_format.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

using Clock = std::chrono::steady_clock;

std::string Format(const CreateModelOptions& options, const std::string& file) {
  return options.format.empty() ? MeshFormatOf(file) : options.format;
}

/// Returns the label, in which bytes of a file's name that are not UTF-8 are escaped.
std::string LabelOf(const CreateModelOptions& options, const std::string& file) {
  return options.label.empty() ? EscapedText(std::filesystem::path(file).stem().string())
                               : options.label;
}

absl::StatusOr<v1::CreateModalModelRequest> MakeRequest(const CreateModelOptions& options,
                                                        const std::string& file,
                                                        std::string mesh_digest) {
  ASSIGN_OR_RETURN(auto material, ToMaterial(options.material));
  v1::CreateModalModelRequest request;
  request.set_mesh_digest(std::move(mesh_digest));
  request.set_mesh_format(Format(options, file));
  *request.mutable_settings() = options.settings;
  request.set_coarse_first(options.coarse_first);
  request.set_without_transfer(options.without_transfer);
  *request.mutable_material() = std::move(material);
  request.set_size(options.size);
  request.set_min_frequency_hz(options.min_frequency_hz);
  request.set_max_frequency_hz(options.max_frequency_hz);
  request.set_priority(options.priority);
  request.set_time_limit_s(options.time_limit_s);
  request.set_memory_limit_bytes(options.memory_limit_mib << 20U);
  request.set_label(LabelOf(options, file));
  return request;
}

/// Asks for the model of one file.
absl::StatusOr<v1::Job> RequestModel(const client::Client& daemon,
                                     const CreateModelOptions& options, const std::string& file) {
  ASSIGN_OR_RETURN(const std::string bytes, ReadMeshFile(file, Format(options, file)));
  ASSIGN_OR_RETURN(std::string digest, daemon.UploadMesh(bytes));
  ASSIGN_OR_RETURN(const v1::CreateModalModelRequest request,
                   MakeRequest(options, file, std::move(digest)));
  return daemon.CreateModalModel(request);
}

bool HelpsToRepair(const v1::Remedy& remedy) { return remedy.field() == "settings.mesh.repair"; }

bool HasEnded(const v1::Job& job) {
  return job.state() != v1::JOB_STATE_QUEUED && job.state() != v1::JOB_STATE_RUNNING;
}

/// Returns whether the daemon takes no more jobs of this client until some of them have ended.
bool MustWait(const absl::Status& error) {
  const std::string reason = ToErrorInfo(error).reason();
  return reason == "QUEUE_FULL" || reason == "CLIENT_LIMIT_REACHED" || reason == "TOO_MANY_CALLS";
}

/// Creates the models of several files. All are requested before the first is waited for, as far as
/// the daemon takes them, so that they are computed side by side. A surface that is refused, and
/// that repair may help, is asked for again with repair as soon as its refusal is known; where that
/// fails, too, its refusal is told, which also names the first.
class ModelCreation {
 public:
  ModelCreation(const client::Client& daemon, const CreateModelOptions& options, bool json)
      : daemon_(daemon), options_(options), repairing_(options), json_(json) {
    repairing_.settings.mutable_mesh()->set_repair(true);
  }

  /// Errors: Internal (OUTPUT_NOT_WRITABLE), Unavailable (SERVER_UNAVAILABLE), that of the file if
  /// there is one file, FailedPrecondition (SOME_FAILED) if there are several.
  absl::Status Run() {
    RETURN_IF_ERROR(CheckMaterial());
    RETURN_IF_ERROR(OpenReport());
    for (size_t i = 0; i < options_.files.size(); ++i) {
      RETURN_IF_ERROR(Request({.index = i, .begin = Clock::now()}));
    }
    while (!requested_.empty()) {
      RETURN_IF_ERROR(FinishSome());
    }
    if (failed_count_ == 0 || options_.files.size() == 1) return last_error_;
    return Refusal(absl::StatusCode::kFailedPrecondition, "SOME_FAILED",
                   absl::StrCat(failed_count_, " of ", Counted(options_.files.size(), "file"),
                                " gave no model; the messages above",
                                options_.report.empty() ? "" : " and the rows of the report",
                                " say why; repair them and run the command again"));
  }

 private:
  struct Requested {
    size_t index = 0;  ///< of the file
    Clock::time_point begin;
    bool repairs = false;
    bool computes = false;  ///< whether a job runs, or did not find the model stored
  };

  const std::string& FileOf(const Requested& requested) const {
    return options_.files[requested.index];
  }

  /// An error in the material would be that of every file, and is told once, before the first.
  absl::Status CheckMaterial() const {
    ASSIGN_OR_RETURN(const v1::Material material, ToMaterial(options_.material));
    const absl::Status resolved = ResolveMaterial(material).status();
    return ToErrorInfo(resolved).reason() == "UNKNOWN_MATERIAL" ? resolved : absl::OkStatus();
  }

  absl::Status OpenReport() {
    if (options_.report.empty()) return absl::OkStatus();
    report_.open(options_.report, std::ios::binary | std::ios::trunc);
    return CheckReport();
  }

  absl::Status CheckReport() const {
    if (options_.report.empty() || report_) return absl::OkStatus();
    return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                   absl::StrCat(options_.report,
                                " cannot be written; check its folder, its "
                                "permissions and the free space"));
  }

  absl::Status Request(const Requested& requested) {
    while (true) {
      const CreateModelOptions& options = requested.repairs ? repairing_ : options_;
      const absl::StatusOr<v1::Job> job = RequestModel(daemon_, options, FileOf(requested));
      if (!job.ok() && options_.wait && MustWait(job.status())) {
        RETURN_IF_ERROR(AwaitPlace());
        continue;
      }
      if (!job.ok()) return Fail(requested, job.status());
      if (HasEnded(*job)) return Finish(requested, job->name());
      if (!options_.wait) return Succeed(requested, *job);
      Requested computed = requested;
      computed.computes = true;
      requested_.emplace(job->name(), computed);
      return absl::OkStatus();
    }
  }

  absl::Status AwaitPlace() {
    if (!requested_.empty()) return FinishSome();
    std::this_thread::sleep_for(std::chrono::seconds(1));  // other clients fill the queue
    return absl::OkStatus();
  }

  /// Waits until one of the requested jobs has ended, and finishes the files of those that have.
  absl::Status FinishSome() {
    std::set<std::string> ended;
    if (options_.files.size() == 1) {
      ended = {requested_.begin()->first};  // Finish waits for it, and shows its progress
    } else {
      ASSIGN_OR_RETURN(ended, AwaitSome());
    }
    for (const std::string& job : ended) {
      while (true) {
        const auto at = requested_.find(job);
        if (at == requested_.end()) break;
        const Requested requested = at->second;
        requested_.erase(at);
        RETURN_IF_ERROR(Finish(requested, job));
      }
    }
    return absl::OkStatus();
  }

  /// Returns those of the requested jobs that have ended, at least one.
  absl::StatusOr<std::set<std::string>> AwaitSome() {
    std::set<std::string> active, ended;
    seen_until_ = watch_end_;
    RETURN_IF_ERROR(daemon_.WatchJobs({}, [&](const v1::WatchJobsResponse& answer) {
      const std::string& name = answer.job().name();
      if (answer.has_job() && requested_.contains(name)) {
        (HasEnded(answer.job()) ? ended : active).insert(name);
        NoteStart(answer.job());
      }
      // A requested job that is not among those that wait or run has ended before.
      for (auto at = requested_.begin(); !answer.has_job() && at != requested_.end(); ++at) {
        if (!active.contains(at->first)) ended.insert(at->first);
      }
      return ended.empty();
    }));
    watch_end_ = Clock::now();
    return ended;
  }

  /// Keeps the time at which a job that runs was started.
  void NoteStart(const v1::Job& job) {
    if (job.state() != v1::JOB_STATE_RUNNING || started_.contains(job.name())) return;
    // The clock of this machine may differ from the daemon's.
    const auto run = std::chrono::system_clock::now().time_since_epoch() -
                     std::chrono::milliseconds(job.started_unix_ms());
    const auto now = Clock::now();
    started_[job.name()] = std::clamp(now - std::chrono::duration_cast<Clock::duration>(run),
                                      std::min(seen_until_, now), now);
  }

  /// Returns the time since the job was started, seconds. A job whose start was not seen was
  /// started since the last look.
  double RunSeconds(const Requested& requested, const std::string& job) const {
    if (!requested.computes) return 0;
    const auto at = started_.find(job);
    const Clock::time_point start =
        at != started_.end() ? at->second : std::max(seen_until_, requested.begin);
    return std::chrono::duration<double>(Clock::now() - start).count();
  }

  absl::Status Finish(const Requested& requested, const std::string& name) {
    const absl::StatusOr<v1::Job> job =
        options_.files.size() == 1 && options_.wait
            ? WatchWithProgress(daemon_, name, [&](const v1::Job& state) { NoteStart(state); })
            : daemon_.WatchJob(name, nullptr);
    if (job.ok()) return Succeed(requested, *job);
    const v1::ErrorInfo refusal = ToErrorInfo(job.status());
    const bool repairs = options_.wait && options_.may_repair && !requested.repairs &&
                         std::ranges::any_of(refusal.remedies(), HelpsToRepair);
    if (!repairs) return Fail(requested, job.status());
    absl::FPrintF(stderr, "carillon: %s is asked for again with --repair: %s: %s\n",
                  EscapedText(FileOf(requested)), refusal.reason(), refusal.message());
    return Request({.index = requested.index, .begin = requested.begin, .repairs = true});
  }

  absl::Status Succeed(const Requested& requested, const v1::Job& job) {
    const std::string& file = FileOf(requested);
    std::vector<JsonMember> members = {{"file", file},
                                       {"index", uint64_t{requested.index}},
                                       {"seconds", RunSeconds(requested, job.name())}};
    if (job.state() == v1::JOB_STATE_SUCCEEDED) {
      AddModel(file, job.modal_model(), members);
    } else {
      absl::FPrintF(stderr,
                    "carillon: %s is being computed; follow it with: carillon job watch %s\n",
                    EscapedText(job.label()), ShortName(job));
    }
    if (!json_) absl::PrintF("%s\n", job.modal_model());
    return PrintRow(MessageJson(job, members));
  }

  absl::Status Fail(const Requested& requested, const absl::Status& error) {
    ++failed_count_;
    last_error_ = error;
    if (ToErrorInfo(error).reason() == "SERVER_UNAVAILABLE") return error;
    const std::string& file = FileOf(requested);
    const std::string row = MembersJson({{"file", file},
                                         {"index", uint64_t{requested.index}},
                                         {"error", JsonText{MessageJson(ToErrorInfo(error))}}});
    if (options_.files.size() == 1) return WriteRow(row);  // the command ends with the error
    absl::FPrintF(stderr, "carillon: %s:\n", EscapedText(file));
    (void)Report(error);
    return PrintRow(row);
  }

  absl::Status PrintRow(const std::string& row) {
    if (json_) absl::PrintF("%s\n", row);
    std::fflush(stdout);
    return WriteRow(row);
  }

  absl::Status WriteRow(const std::string& row) {
    if (options_.report.empty()) return absl::OkStatus();
    report_ << row << '\n' << std::flush;
    return CheckReport();
  }

  /// Prints what the user should know about a model that was just made, or was there before, and
  /// adds its figures.
  void AddModel(const std::string& file, const std::string& name,
                std::vector<JsonMember>& members) const {
    const auto model = daemon_.GetModalModel(name);
    if (!model.ok()) return;  // it was deleted meanwhile
    std::vector<std::string> warnings(model->header().warnings().begin(),
                                      model->header().warnings().end());
    const std::string other = OtherLabel(*model, LabelOf(options_, file));
    if (!other.empty()) warnings.push_back(other);
    for (const std::string& warning : warnings) {
      absl::FPrintF(stderr, "warning: %s\n", EscapedText(warning));
    }
    members.push_back({"warnings", std::move(warnings)});
    members.push_back({"node_count", uint64_t{model->header().node_count()}});
    const auto asked = ToMaterial(options_.material);
    const bool named = asked.ok() && asked->ByteSizeLong() > 0;
    const auto material = MatchedMaterial(*model, named ? *asked : model->material());
    if (!material.ok()) return;
    members.push_back(MaterialMember(*material, named ? *asked : model->material()));
    for (JsonMember& member : ModeMembers(ModesOf(*model, *material, options_.size))) {
      members.push_back(std::move(member));
    }
  }

  const client::Client& daemon_;
  const CreateModelOptions& options_;
  CreateModelOptions repairing_;
  const bool json_;
  std::ofstream report_;
  std::multimap<std::string, Requested> requested_;   ///< by the job, which files may share
  std::map<std::string, Clock::time_point> started_;  ///< by the job
  /// The end of the last watch, and of the one before: starts up to then were seen.
  Clock::time_point watch_end_ = Clock::now(), seen_until_ = watch_end_;
  size_t failed_count_ = 0;
  absl::Status last_error_;
};

}  // namespace

absl::Status CreateModel(const client::Client& daemon, const CreateModelOptions& options,
                         bool json) {
  return ModelCreation(daemon, options, json).Run();
}

}  // namespace carillon::cli
