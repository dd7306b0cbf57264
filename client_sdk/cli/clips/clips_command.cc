// SPDX-License-Identifier: Apache-2.0
//
// `carillon render FOLDER --out FOLDER`: the contact traces of a folder, several at a time.
#include "client_sdk/cli/clips/clips_command.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/synchronization/mutex.h"
#include "client_sdk/cli/clips/clip_folder.h"
#include "client_sdk/cli/clips/clip_record.h"
#include "client_sdk/cli/clips/file_digest.h"
#include "client_sdk/cli/commands/mode_sound.h"
#include "client_sdk/cli/output/output.h"
#include "client_sdk/cli/output/rendered_file.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

namespace fs = std::filesystem;

std::string TracePath(const RenderOptions& options, const std::string& clip) {
  return (fs::path(options.trace) / absl::StrCat(clip, ".contacts")).string();
}

/// Renders one clip after the other. Several threads may use one.
class ClipRenderer {
 public:
  ClipRenderer(const client::Client& daemon, const RenderOptions& options, const ClipFolder& folder,
               const StopSignal& stop, std::string settings)
      : daemon_(daemon),
        options_(options),
        folder_(folder),
        stop_(stop),
        settings_(std::move(settings)) {}

  /// Whether a signal has asked to end the run.
  bool IsInterrupted() const {
    if (!interrupted_ && stop_.ArrivesWithin(0)) interrupted_ = true;
    return interrupted_;
  }

  /// Returns whether there was anything to do. Errors: those of the trace and of the daemon.
  absl::StatusOr<bool> Render(const std::string& clip) const {
    const std::string trace = TracePath(options_, clip);
    ClipRecord record;
    record.clip = clip;
    record.settings = settings_;
    ASSIGN_OR_RETURN(record.trace_digest, FileDigest(trace));
    RETURN_IF_ERROR(ReadHead(trace, record));
    std::vector<ObjectState> states = StatesOf(record.objects);
    record.states = states;
    if (IsRendered(folder_.Final(""), record)) return false;
    do {  // once more if a material or a transfer has changed meanwhile
      record.states = std::move(states);
      record.stems.clear();
      RETURN_IF_ERROR(RenderSound(trace, record));
      for (const v1::ContactTraceObject& object : record.objects) {
        if (options_.stems) RETURN_IF_ERROR(RenderStem(trace, object.handle(), record));
      }
      states = StatesOf(record.objects);
    } while (!AreSame(states, record.states));
    const std::string stems = absl::StrCat(clip, ".stems");
    std::error_code ignored;
    if (record.stems.empty()) fs::remove_all(folder_.Final(stems), ignored);
    if (!record.stems.empty()) RETURN_IF_ERROR(folder_.Publish(stems));
    RETURN_IF_ERROR(folder_.Publish(record.sound.name));
    RETURN_IF_ERROR(folder_.Write(absl::StrCat(clip, ".json"), RecordLine(record)));
    return true;
  }

  absl::Status RecordError(const std::string& clip, const absl::Status& error) const {
    return folder_.Write(absl::StrCat(clip, ".json"), ErrorLine(clip, error));
  }

 private:
  /// Reads the labels and the objects of a trace.
  static absl::Status ReadHead(const std::string& path, ClipRecord& clip) {
    ASSIGN_OR_RETURN(client::ContactTraceReader trace, client::ContactTraceReader::Open(path));
    clip.labels = {trace.header().labels().begin(), trace.header().labels().end()};
    while (true) {
      ASSIGN_OR_RETURN(const std::optional<v1::ContactTraceRecord> record, trace.Next());
      if (!record || !record->has_object()) return absl::OkStatus();
      clip.objects.push_back(record->object());
    }
  }

  /// Asks the daemon what the objects would sound with now.
  std::vector<ObjectState> StatesOf(const std::vector<v1::ContactTraceObject>& objects) const {
    std::vector<ObjectState> states;
    for (const v1::ContactTraceObject& object : objects) {
      ObjectState& state = states.emplace_back();
      const auto model = daemon_.GetModalModel(object.modal_model());
      if (!model.ok()) continue;  // which keeps a clip, and is the error of any other
      const bool is_named = object.material().ByteSizeLong() > 0;
      const v1::Material& asked = is_named ? object.material() : model->material();
      auto material = MatchedMaterial(*model, asked);
      if (!material.ok()) continue;
      state.has_transfer = object.radiation() != v1::RADIATION_MODEL_PAPER_COUPLING &&
                           HasTransfer(*model, *material);
      state.material = *std::move(material);
      state.material->set_preset(asked.preset());
    }
    return states;
  }

  absl::Status RenderSound(const std::string& trace, ClipRecord& record) const {
    record.sound.name = absl::StrCat(record.clip, ".wav");
    const RenderedForm form = FormOf(options_, folder_.Work(record.sound.name).string());
    v1::RenderSettings settings = SettingsOf(options_);
    settings.set_tell_blows(true);
    RETURN_IF_ERROR(RenderFile(trace, settings, form, record));
    RETURN_IF_ERROR(CheckHasContacts(trace, record.summary));
    if (const auto better = BetterFullScale(options_, record.summary)) {
      settings.set_full_scale_pa(*better);
      RETURN_IF_ERROR(RenderFile(trace, settings, form, record));
    }
    ASSIGN_OR_RETURN(record.sound.digest, FileDigest(form.path));
    return absl::OkStatus();
  }

  /// The sound of one object: the others are struck as well, but silent.
  absl::Status RenderStem(const std::string& trace, uint32_t handle, ClipRecord& record) const {
    ClipFile stem;
    stem.name = absl::StrCat(record.clip, ".stems/", handle, ".wav");
    RenderedForm form = FormOf(options_, folder_.Work(stem.name).string());
    form.factor = record.factor;
    form.normalize = false;
    form.frame_count = record.frame_count;
    if (!record.is_cut) form.fade_frame_count = 0;
    const std::string alone = folder_.Work(absl::StrCat(record.clip, ".alone")).string();
    RETURN_IF_ERROR(WriteAlone(trace, handle, alone));
    ClipRecord unused;
    v1::RenderSettings settings = SettingsOf(options_);
    settings.set_full_scale_pa(record.summary.full_scale_pa());
    RETURN_IF_ERROR(RenderFile(alone, settings, form, unused));
    std::error_code ignored;
    fs::remove(alone, ignored);
    ASSIGN_OR_RETURN(stem.digest, FileDigest(form.path));
    record.stems.push_back(std::move(stem));
    return absl::OkStatus();
  }

  static absl::Status WriteAlone(const std::string& path, uint32_t handle,
                                 const std::string& alone) {
    ASSIGN_OR_RETURN(client::ContactTraceReader trace, client::ContactTraceReader::Open(path));
    ASSIGN_OR_RETURN(client::ContactTraceWriter copy,
                     client::ContactTraceWriter::Create(alone, trace.header()));
    while (true) {
      ASSIGN_OR_RETURN(std::optional<v1::ContactTraceRecord> record, trace.Next());
      if (!record) return copy.Close();
      if (record->has_step()) {
        RETURN_IF_ERROR(copy.Write(record->step()));
      }
      if (!record->has_object()) continue;
      if (record->object().handle() != handle) record->mutable_object()->set_gain(0);
      copy.Write(record->object());
    }
  }

  /// Waits while the daemon renders as much as it may.
  absl::Status RenderFile(const std::string& path, const v1::RenderSettings& settings,
                          const RenderedForm& form, ClipRecord& record) const {
    constexpr auto kPause = std::chrono::milliseconds(50);
    while (true) {
      absl::Status status = TryRenderFile(path, settings, form, record);
      const std::string reason = status.ok() ? "" : ToErrorInfo(status).reason();
      const bool may_soon = reason == "TOO_MANY_CALLS" || reason == "CLIENT_LIMIT_REACHED";
      if (!may_soon || IsInterrupted()) return status;
      std::this_thread::sleep_for(kPause);
    }
  }

  absl::Status TryRenderFile(const std::string& path, const v1::RenderSettings& settings,
                             const RenderedForm& form, ClipRecord& record) const {
    ASSIGN_OR_RETURN(client::ContactTraceReader trace, client::ContactTraceReader::Open(path));
    RenderedFile file(form);
    record.blows.clear();
    auto summary = daemon_.Render(
        settings, trace,
        [&](const client::AudioBlock& block) { return !IsInterrupted() && file.Take(block); },
        [&](const v1::Blow& blow) { record.blows.push_back(blow); });
    RETURN_IF_ERROR(file.status());
    RETURN_IF_ERROR(summary.status());
    RETURN_IF_ERROR(file.Finish());
    record.summary = *std::move(summary);
    file.Describe(record.summary);
    record.factor = file.factor();
    record.frame_count = file.frame_count();
    record.sample_rate_hz = form.format.sample_rate_hz;
    record.is_cut = file.is_cut();
    return absl::OkStatus();
  }

  const client::Client& daemon_;
  const RenderOptions& options_;
  const ClipFolder& folder_;
  const StopSignal& stop_;
  const std::string settings_;
  mutable std::atomic<bool> interrupted_{false};
};

/// Whether an error would meet every other clip, too.
bool StopsAll(const absl::Status& error) {
  const std::string reason = ToErrorInfo(error).reason();
  return reason == "SERVER_UNAVAILABLE" || reason == "OUTPUT_NOT_WRITABLE" ||
         absl::IsUnauthenticated(error) || absl::IsPermissionDenied(error);
}

/// The clips of one run, of which each worker takes the next.
class ClipRun {
 public:
  ClipRun(const ClipRenderer& renderer, std::vector<std::string> clips)
      : renderer_(renderer), clips_(std::move(clips)) {}

  /// Returns the error that stopped the run.
  absl::Status Run(size_t worker_count) {
    std::vector<std::jthread> workers;
    for (size_t i = 0; i < worker_count; ++i) workers.emplace_back([this] { Work(); });
    workers.clear();
    return stop_;
  }

  size_t rendered_count() const { return rendered_count_; }
  size_t kept_count() const { return kept_count_; }
  size_t failed_count() const { return failed_count_; }

 private:
  void Work() {
    for (size_t i = next_++; i < clips_.size() && !stopped_; i = next_++) Take(clips_[i]);
  }

  void Take(const std::string& clip) {
    const absl::StatusOr<bool> rendered = renderer_.Render(clip);
    if (rendered.ok()) {
      ++(*rendered ? rendered_count_ : kept_count_);
      return;
    }
    if (renderer_.IsInterrupted()) {
      return Stop(Refusal(absl::StatusCode::kCancelled, "RENDERING_STOPPED",
                          "a signal ended the run; the same command continues it"));
    }
    if (StopsAll(rendered.status())) return Stop(rendered.status());
    ++failed_count_;
    const absl::Status recorded = renderer_.RecordError(clip, rendered.status());
    if (!recorded.ok()) Stop(recorded);
  }

  void Stop(const absl::Status& error) {
    const absl::MutexLock lock(&mutex_);
    if (!stopped_.exchange(true)) stop_ = error;
  }

  const ClipRenderer& renderer_;
  const std::vector<std::string> clips_;
  std::atomic<size_t> next_{0}, rendered_count_{0}, kept_count_{0}, failed_count_{0};
  std::atomic<bool> stopped_{false};
  absl::Mutex mutex_;
  absl::Status stop_;  // guarded by mutex_ until the workers have ended
};

std::vector<std::string> OfShard(const std::vector<std::string>& clips, const Shard& shard) {
  std::vector<std::string> mine;
  for (size_t i = shard.number - 1; i < clips.size(); i += shard.count) mine.push_back(clips[i]);
  return mine;
}

/// Returns the least full scale, Pa, rounded up to three digits, at which the limiter alters no
/// clip.
double FullScaleForAll(const ClipTotals& totals) {
  const double wanted_pa = std::max(totals.peak_pa * kLimiterHeadroom, kLeastFullScale_pa);
  const double unit = std::pow(10, std::floor(std::log10(wanted_pa)) - 2);
  return std::ceil(wanted_pa / unit) * unit;
}

void PrintRunJson(const ClipRun& run, const ClipTotals& totals, double seconds) {
  std::vector<JsonMember> members = {{"rendered", run.rendered_count()},
                                     {"kept", run.kept_count()},
                                     {"failed", run.failed_count()},
                                     {"seconds", seconds},
                                     {"frame_count", totals.frame_count},
                                     {"limited_frame_count", totals.limited_frame_count},
                                     {"limited_clip_count", uint64_t{totals.limited_clips.size()}},
                                     {"peak_pa", totals.peak_pa},
                                     {"warnings", totals.warnings}};
  if (totals.peak_pa > 0) members.push_back({"full_scale_for_all_pa", FullScaleForAll(totals)});
  PrintJson(members);
}

/// Prints what the limiter did to the clips of the folder, and the full scale that suits all.
void PrintLevels(const RenderOptions& options, const ClipTotals& totals) {
  constexpr size_t kShown = 5;
  if (!totals.limited_clips.empty()) {
    absl::PrintF("the limiter altered %s of %d, in %.2g %% of all frames:\n",
                 Counted(totals.limited_clips.size(), "clip"), totals.clip_count,
                 100 * static_cast<double>(totals.limited_frame_count) /
                     static_cast<double>(totals.frame_count));
  }
  for (size_t i = 0; i < std::min(kShown, totals.limited_clips.size()); ++i) {
    absl::PrintF("  %s: %.2g %% of its frames\n", EscapedText(totals.limited_clips[i].clip),
                 100 * totals.limited_clips[i].share);
  }
  if (totals.limited_clips.size() > kShown) {
    absl::PrintF("  and others: limited_frame_count in manifest.jsonl\n");
  }
  if (totals.peak_pa > 0 && !options.normalize) {
    absl::PrintF("the loudest clip peaks at %.3g Pa; --full-scale-pa %.4g suits all clips\n",
                 totals.peak_pa, FullScaleForAll(totals));
  }
  for (const std::string& warning : totals.warnings) absl::PrintF("%s\n", warning);
}

void PrintRun(const ClipRun& run, double seconds) {
  absl::PrintF("%s in %.1f s (%.0f an hour), %d there already, %d failed\n",
               Counted(run.rendered_count(), "clip"), seconds,
               static_cast<double>(run.rendered_count()) * 3600 / std::max(seconds, 1e-3),
               run.kept_count(), run.failed_count());
}

}  // namespace

absl::Status RenderClips(const client::Client& daemon, const RenderOptions& options,
                         const StopSignal& stop, bool json) {
  const auto begin = std::chrono::steady_clock::now();
  ASSIGN_OR_RETURN(const std::vector<std::string> clips, ListTraces(options.trace));
  const std::vector<std::string> mine = OfShard(clips, options.shard);
  if (options.wait) {
    std::vector<std::string> traces;
    traces.reserve(mine.size());
    for (const std::string& clip : mine) traces.push_back(TracePath(options, clip));
    AwaitedJobs jobs(daemon, stop);
    RETURN_IF_ERROR(AwaitTransfers(jobs, traces));
  }
  ASSIGN_OR_RETURN(const v1::GetMixerResponse mixer, daemon.GetMixer());
  ASSIGN_OR_RETURN(const ClipFolder folder, ClipFolder::Open(options.out));
  const ClipRenderer renderer(daemon, options, folder, stop,
                              SettingsText(options, mixer.version()));
  ClipRun run(renderer, mine);
  const absl::Status stopped = run.Run(options.worker_count);
  RETURN_IF_ERROR(folder.WriteManifest(clips));
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const ClipTotals totals = TotalsOf(folder.Final("manifest.jsonl"));
  if (json) {
    PrintRunJson(run, totals, seconds);
  } else {
    PrintRun(run, seconds);
    PrintLevels(options, totals);
  }
  RETURN_IF_ERROR(stopped);
  if (run.failed_count() == 0) return absl::OkStatus();
  return Refusal(absl::StatusCode::kFailedPrecondition, "SOME_FAILED",
                 absl::StrCat(Counted(run.failed_count(), "clip"), " could not be rendered; ",
                              folder.Final("manifest.jsonl").string(),
                              " says why; repair what it names and run the command again"));
}

}  // namespace carillon::cli
