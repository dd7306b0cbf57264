// SPDX-License-Identifier: Apache-2.0
#include "server/daemon/daemon_metrics.h"

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <system_error>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/strip.h"
#include "server/daemon/heap.h"
#include "server/mode_database/database.h"
#include "server/mode_database/maintenance/database_admin.h"

namespace carillon {
namespace {

using Metrics = std::vector<Metric>;

void Gauge(Metrics& metrics, std::string name, std::string help, double value) {
  metrics.push_back({.name = std::move(name),
                     .help = std::move(help),
                     .kind = Metric::Kind::kGauge,
                     .values = {{.value = value}}});
}

void Counter(Metrics& metrics, std::string name, std::string help, uint64_t value) {
  metrics.push_back({.name = std::move(name),
                     .help = std::move(help),
                     .kind = Metric::Kind::kCounter,
                     .values = {{.value = static_cast<double>(value)}}});
}

MetricValue Of(std::string label, uint64_t value) {
  return {.label = std::move(label), .value = static_cast<double>(value)};
}

void AddOutput(Metrics& metrics, const LiveOutput& output, const OutputState& state) {
  const double block_s =
      static_cast<double>(output.format().block_frame_count) / output.format().sample_rate_hz;
  Gauge(metrics, "carillon_render_load_ratio", "Fraction of real time that rendering takes.",
        state.load);
  Gauge(metrics, "carillon_render_slack_seconds",
        "Time left before the deadline of a block, on average.", (1 - state.load) * block_s);
  Gauge(metrics, "carillon_output_latency_seconds", "From the mixer to audible sound.",
        state.latency_s);
  Gauge(metrics, "carillon_device_playing", "1: the wanted sound device plays.",
        state.device_plays ? 1 : 0);
  Counter(metrics, "carillon_xruns_total", "Times at which the device found too few frames.",
          state.xrun_count);
  Counter(metrics, "carillon_frames_lost_total", "Frames that were silent for want of others.",
          state.lost_frame_count);
  Counter(metrics, "carillon_frames_rendered_total", "Frames that the mixer has rendered.",
          state.mixer.frame_count);
  Counter(metrics, "carillon_frames_limited_total", "Frames that the limiter has changed.",
          state.mixer.limited_frame_count);
}

void AddMixer(Metrics& metrics, LiveOutput& output, const MixerStatistics& mixer) {
  const uint64_t sounding = mixer.active_mode_count;
  const uint64_t all = output.mixer().mode_count();
  metrics.push_back(
      {.name = "carillon_modes",
       .help = "Modes of all objects.",
       .kind = Metric::Kind::kGauge,
       .label_name = "state",
       .values = {Of("sounding", sounding), Of("asleep", all > sounding ? all - sounding : 0)}});
  metrics.push_back({.name = "carillon_impulses_total",
                     .help = "Impulses by what became of them; those merged or shed came in time.",
                     .kind = Metric::Kind::kCounter,
                     .label_name = "outcome",
                     .values = {Of("in_time", mixer.accepted_count), Of("late", mixer.late_count),
                                Of("merged", mixer.merged_count), Of("shed", mixer.shed_count),
                                Of("dropped", mixer.dropped_count)}});
  metrics.push_back({.name = "carillon_objects_silenced_total",
                     .help = "Times at which an object was silenced, by reason.",
                     .kind = Metric::Kind::kCounter,
                     .label_name = "reason",
                     .values = {Of("overload", mixer.shed_bank_count),
                                Of("not_finite", mixer.reset_bank_count)}});
  Counter(metrics, "carillon_blocks_bounded_total",
          "Blocks in which an object was lowered because it was louder than any body.",
          mixer.bounded_bank_count);
}

void AddScenes(Metrics& metrics, const SceneRegistry& scenes) {
  Gauge(metrics, "carillon_scenes", "Scenes.", static_cast<double>(scenes.scene_count()));
  Gauge(metrics, "carillon_objects", "Objects in all scenes.",
        static_cast<double>(scenes.object_count()));
  Metric rejected{.name = "carillon_impulses_rejected_total",
                  .help = "Contacts that could not be used, by the reason of the refusal.",
                  .kind = Metric::Kind::kCounter,
                  .label_name = "reason"};
  for (const auto& [reason, count] : scenes.rejections().counts()) {
    rejected.values.push_back(Of(reason, count));
  }
  metrics.push_back(std::move(rejected));
}

void AddClients(Metrics& metrics, const ClientCounts& clients) {
  Gauge(metrics, "carillon_connections", "Open connections of clients.",
        static_cast<double>(clients.connections));
  metrics.push_back(
      {.name = "carillon_calls",
       .help = "Long calls that run.",
       .kind = Metric::Kind::kGauge,
       .label_name = "kind",
       .values = {Of("contact_stream", clients.contact_streams), Of("listener", clients.listeners),
                  Of("rendering", clients.renderings)}});
}

/// "PHASE_SOLVE" as "solve".
std::string PhaseName(size_t phase) {
  return absl::AsciiStrToLower(
      absl::StripPrefix(v1::Phase_Name(static_cast<int>(phase)), "PHASE_"));
}

void AddPhases(Metrics& metrics, const PhaseUses& phases) {
  Metric seconds{.name = "carillon_job_phase_seconds_total",
                 .help = "Time that decompositions have spent in each phase.",
                 .kind = Metric::Kind::kCounter,
                 .label_name = "phase"};
  Metric memory{.name = "carillon_job_phase_peak_memory_bytes",
                .help = "Largest memory of one decomposition within each phase.",
                .kind = Metric::Kind::kGauge,
                .label_name = "phase"};
  for (size_t phase = v1::PHASE_UNSPECIFIED + 1; phase < phases.size(); ++phase) {
    seconds.values.push_back({.label = PhaseName(phase), .value = phases[phase].seconds});
    memory.values.push_back(Of(PhaseName(phase), phases[phase].peak_bytes));
  }
  metrics.push_back(std::move(seconds));
  metrics.push_back(std::move(memory));
}

void AddTls(Metrics& metrics, const std::optional<double>& certificate_left_s) {
  if (!certificate_left_s) return;
  Gauge(metrics, "carillon_tls_certificate_left_seconds",
        "Time until the first of the daemon's certificates expires.", *certificate_left_s);
}

void AddJobs(Metrics& metrics, const DecompositionQueue::Counts& jobs) {
  metrics.push_back({.name = "carillon_jobs",
                     .help = "Decompositions that wait or run.",
                     .kind = Metric::Kind::kGauge,
                     .label_name = "state",
                     .values = {Of("queued", jobs.queued), Of("running", jobs.running)}});
  metrics.push_back({.name = "carillon_jobs_ended_total",
                     .help = "Decompositions that ran and have ended.",
                     .kind = Metric::Kind::kCounter,
                     .label_name = "state",
                     .values = {Of("succeeded", jobs.succeeded), Of("failed", jobs.failed),
                                Of("cancelled", jobs.cancelled)}});
  AddPhases(metrics, jobs.phases);
}

void AddDatabase(Metrics& metrics, Database& database) {
  Gauge(metrics, "carillon_database_serving", "1: the database can be changed.",
        database.CheckState().ok() ? 1 : 0);
  std::error_code error;
  const std::filesystem::space_info disk = std::filesystem::space(database.folder(), error);
  if (!error) {
    Gauge(metrics, "carillon_disk_free_bytes", "Free space on the disk of the database.",
          static_cast<double>(disk.available));
  }
  const absl::StatusOr<DatabaseStats> stats = ReadStats(database);
  if (!stats.ok()) return;
  Gauge(metrics, "carillon_database_bytes", "Size of the database's file.",
        static_cast<double>(stats->file_bytes));
  Gauge(metrics, "carillon_database_free_bytes", "Unused space in it.",
        static_cast<double>(stats->free_bytes));
  Gauge(metrics, "carillon_models", "Modal models.", static_cast<double>(stats->model_count));
  Gauge(metrics, "carillon_models_quarantined", "Modal models that were found damaged.",
        static_cast<double>(stats->quarantined_count));
}

/// Resident memory of this process.
double ResidentBytes() {
  std::ifstream statm("/proc/self/statm");
  uint64_t whole = 0;
  uint64_t resident = 0;
  statm >> whole >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

}  // namespace

std::vector<Metric> ReadMetrics(const MeasuredRooms& rooms) {
  const OutputState state = rooms.output.state();
  Metrics metrics;
  metrics.push_back({.name = "carillon_build_info",
                     .help = "1, with the version of the daemon.",
                     .kind = Metric::Kind::kGauge,
                     .label_name = "version",
                     .values = {{.label = rooms.version, .value = 1}}});
  AddOutput(metrics, rooms.output, state);
  AddMixer(metrics, rooms.output, state.mixer);
  AddScenes(metrics, rooms.scenes);
  AddClients(metrics, rooms.server.clients());
  AddTls(metrics, rooms.server.certificate_left_s());
  AddJobs(metrics, rooms.decompositions.counts());
  Gauge(metrics, "carillon_decompositions_serving", "1: decompositions can run and be stored.",
        rooms.server.serves_decompositions() ? 1 : 0);
  AddDatabase(metrics, rooms.database.database());
  Gauge(metrics, "process_resident_memory_bytes", "Resident memory of the daemon alone.",
        ResidentBytes());
  Gauge(metrics, "carillon_heap_bytes", "Memory that the daemon has allocated and not freed.",
        static_cast<double>(AllocatedBytes()));
  return metrics;
}

}  // namespace carillon
