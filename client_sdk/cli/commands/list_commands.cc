// SPDX-License-Identifier: Apache-2.0
//
// The commands that show and end jobs, materials, reasons and scenes, and that write the examples.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/commands/example_bodies.h"
#include "client_sdk/cli/commands/find_model.h"
#include "client_sdk/cli/output/job_progress.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/reason_catalogue.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

void PrintObject(const v1::SoundingObject& object) {
  absl::PrintF("  %-6d %-12s  %10s  %8.1f to %.1f Hz  size %.4g  gain %.4g\n", object.handle(),
               absl::StripPrefix(object.modal_model(), "modalModels/").substr(0, 12),
               Counted(object.sounding_mode_count(), "mode"), object.lowest_frequency_hz(),
               object.highest_frequency_hz(), object.size(), object.gain());
}

std::string LeaseText(const v1::Scene& scene) {
  if (scene.keep()) return "kept";
  if (scene.has_ends_in_s()) return absl::StrFormat("ends in %.0f s", scene.ends_in_s());
  return Counted(scene.connection_count(), "connection");
}

void PrintJobLine(const v1::Job& job) { absl::PrintF("%s\n", JobLine(job, absl::Now())); }

/// Prints a time and how long ago it was; nothing if the time is unknown.
void PrintTime(const char* what, int64_t unix_ms) {
  if (unix_ms == 0) return;
  const absl::Time time = absl::FromUnixMillis(unix_ms);
  absl::PrintF("%-10s %s, %s ago\n", what,
               absl::FormatTime("%Y-%m-%d %H:%M:%S", time, absl::LocalTimeZone()),
               RoughTime(std::max(0.0, absl::ToDoubleSeconds(absl::Now() - time))));
}

}  // namespace

absl::Status WatchJobs(const client::Client& daemon, const v1::WatchJobsRequest& filter,
                       bool json) {
  std::map<std::string, v1::JobState> shown;
  const auto show = [&](const v1::WatchJobsResponse& answer) {
    const v1::Job& job = answer.job();
    const auto known = shown.find(job.name());
    const bool news = known == shown.end() || known->second != job.state();
    if (answer.has_job() && json) PrintJson(job);
    if (answer.has_job() && !json && news) PrintJobLine(job);
    shown[job.name()] = job.state();
    return std::fflush(stdout) == 0;  // else the reader has gone
  };
  return daemon.WatchJobs(filter, show);
}

absl::Status ListJobs(const client::Client& daemon, const v1::ListJobsRequest& filter, bool json) {
  ASSIGN_OR_RETURN(const std::vector<v1::Job> jobs, daemon.ListJobs(filter));
  v1::ListJobsResponse list;
  list.mutable_jobs()->Assign(jobs.begin(), jobs.end());
  if (json) {
    PrintJson(list);
    return absl::OkStatus();
  }
  if (jobs.empty()) PrintNothing("job");
  for (const v1::Job& job : jobs) PrintJobLine(job);
  return absl::OkStatus();
}

absl::Status ShowJob(const client::Client& daemon, const std::string& text, bool json) {
  ASSIGN_OR_RETURN(const std::string name, FindJob(daemon, text));
  ASSIGN_OR_RETURN(const v1::Job job, daemon.GetJob(name));
  if (json) {
    PrintJson(job);
    return absl::OkStatus();
  }
  absl::PrintF(
      "%s\nlabel      %s\nstate      %s\nmodel      %s\npriority   %d\nmemory     %.1f MiB\n",
      job.name(), EscapedText(job.label()), ProgressText(job), job.modal_model(), job.priority(),
      static_cast<double>(job.memory_bytes()) / (1 << 20));
  PrintTime("requested", job.created_unix_ms());
  PrintTime("started", job.started_unix_ms());
  if (job.has_error()) {
    absl::PrintF("error      %s: %s\n", job.error().reason(), job.error().message());
  }
  return absl::OkStatus();
}

namespace {

absl::Status CancelJob(const client::Client& daemon, const std::string& text, bool json) {
  ASSIGN_OR_RETURN(const std::string name, FindJob(daemon, text));
  // The daemon answers alike for a job that this call cancels and for one that was cancelled
  // before.
  ASSIGN_OR_RETURN(const v1::Job before, daemon.GetJob(name));
  ASSIGN_OR_RETURN(const v1::Job job, daemon.CancelJob(name));
  if (json) PrintJson(job);
  std::string end;
  if (job.state() == v1::JOB_STATE_SUCCEEDED) end = "succeeded";
  if (job.state() == v1::JOB_STATE_FAILED) {
    end = absl::StrCat("failed (", job.error().reason(), ")");
  }
  if (before.state() == v1::JOB_STATE_CANCELLED) end = "been cancelled";
  if (end.empty()) return absl::OkStatus();
  return Refusal(absl::StatusCode::kNotFound, "JOB_NOT_FOUND",
                 absl::StrCat(job.name(), " has already ", end, ", so there is nothing to cancel"));
}

}  // namespace

absl::Status CancelJobs(const client::Client& daemon, const std::vector<std::string>& texts,
                        bool json) {
  absl::Status first_error;
  for (const std::string& text : texts) {
    const absl::Status ended = CancelJob(daemon, text, json);
    if (ended.ok()) continue;
    if (!first_error.ok()) (void)Report(first_error);
    first_error = ended;
  }
  return first_error;
}

absl::Status ListMaterials(const client::Client& daemon, bool json) {
  ASSIGN_OR_RETURN(const std::vector<v1::CatalogueMaterial> materials, daemon.ListMaterials());
  v1::ListMaterialsResponse list;
  list.mutable_materials()->Assign(materials.begin(), materials.end());
  if (json) {
    PrintJson(list);
    return absl::OkStatus();
  }
  for (const v1::CatalogueMaterial& item : materials) {
    absl::PrintF("%-18s %7.4g GPa  %6.5g kg/m^3\n", item.name(), item.material().young_pa() / 1e9,
                 item.material().density_kg_per_m3());
  }
  return absl::OkStatus();
}

absl::Status ShowMaterial(const client::Client& daemon, const std::string& name, bool json) {
  ASSIGN_OR_RETURN(const std::vector<v1::CatalogueMaterial> materials, daemon.ListMaterials());
  for (const v1::CatalogueMaterial& item : materials) {
    if (item.name() != name) continue;
    if (json) {
      PrintJson(item);
      return absl::OkStatus();
    }
    const v1::Material& material = item.material();
    absl::PrintF("%s\nyoung      %.6g Pa\npoisson    %.4g\ndensity    %.6g kg/m^3\n", name,
                 material.young_pa(), material.poisson_ratio(), material.density_kg_per_m3());
    absl::PrintF("alpha1     %.4g s\nalpha2     %.4g 1/s\n", material.alpha1_s(),
                 material.alpha2_per_s());
    for (const v1::LossFactorPoint& point : material.loss_factor()) {
      absl::PrintF("loss       %.4g at %.6g Hz\n", point.loss_factor(), point.frequency_hz());
    }
    absl::PrintF("source     %s\n", item.source());
    return absl::OkStatus();
  }
  v1::Material unknown;
  unknown.set_preset(name);
  // Its error names the nearest materials.
  absl::Status error = ResolveMaterial(unknown).status();
  if (name != "list" && name != "show") return error;
  v1::ErrorInfo info = ToErrorInfo(error);
  info.set_message(absl::StrCat("no material is named \"", name,
                                "\": `carillon material` lists all, and `carillon material oak` "
                                "shows one"));
  return FromErrorInfo(error.code(), info);
}

absl::Status Explain(const std::string& name, bool json) {
  std::vector<CatalogueReason> reasons = Reasons();
  if (!name.empty()) {
    ASSIGN_OR_RETURN(const CatalogueReason reason, FindReason(name));
    reasons = {reason};
  }
  std::string group;
  for (const CatalogueReason& reason : reasons) {
    if (json) {
      PrintJson({{"reason", reason.name},
                 {"group", reason.group},
                 {"code", reason.code},
                 {"meaning", reason.meaning},
                 {"repair", reason.repair}});
    } else if (name.empty()) {
      if (reason.group != group) absl::PrintF("%s:\n", reason.group);
      group = reason.group;
      absl::PrintF("  %-30s %s\n", reason.name, reason.meaning);
    } else {
      absl::PrintF("%s (%s)\nmeaning    %s\n", reason.name,
                   !reason.code.empty()         ? reason.code
                   : reason.group == "Warnings" ? "a warning"
                                                : "a finding of carillon doctor",
                   reason.meaning);
      absl::PrintF("repair     %s\n", reason.repair);
    }
  }
  return absl::OkStatus();
}

absl::Status ListScenes(const client::Client& daemon, bool json) {
  ASSIGN_OR_RETURN(const std::vector<v1::Scene> scenes, daemon.ListScenes());
  v1::ListScenesResponse list;
  list.mutable_scenes()->Assign(scenes.begin(), scenes.end());
  if (json) {
    PrintJson(list);
    return absl::OkStatus();
  }
  if (scenes.empty()) PrintNothing("scene");
  for (const v1::Scene& scene : scenes) {
    absl::PrintF("%s  %s  gain %.4g%s%s  %s\n", scene.name(),
                 Counted(scene.object_count(), "object"), scene.gain(),
                 scene.muted() ? "  muted" : "", scene.solo() ? "  solo" : "", LeaseText(scene));
    const auto objects = daemon.ListObjects(scene.name());
    // A scene may be deleted meanwhile.
    if (!objects.ok()) continue;
    for (const v1::SoundingObject& object : *objects) PrintObject(object);
  }
  return absl::OkStatus();
}

absl::Status DeleteScene(const client::Client& daemon, const std::string& text, bool json) {
  RETURN_IF_ERROR(daemon.DeleteScene(SceneNamed(text)));
  if (json) PrintJson({{"scene", SceneNamed(text)}});
  return absl::OkStatus();
}

absl::Status WriteExample(const Example& example, const std::vector<double>& size_m,
                          const std::string& path, bool json) {
  const std::string file = path.empty() ? example.name + ".obj" : path;
  const ExampleFile written = WrittenExample(example, size_m);
  RETURN_IF_ERROR(WriteText(file, written.obj));
  if (json) {
    PrintJson({{"file", file},
               {"description", example.description},
               {"material", example.material},
               {"strike", written.strike}});
    return absl::OkStatus();
  }
  absl::PrintF("%s\n", file);
  // To stderr, so that stdout is the name alone.
  absl::FPrintF(stderr, "%s is %s%s. It sounds with:\n", file, example.description,
                size_m.empty() ? "" : ", stretched");
  absl::FPrintF(stderr, "  carillon model create %s --material %s --wait\n", file,
                example.material);
  absl::FPrintF(stderr, "  carillon strike %s %s\n", std::filesystem::path(file).stem().string(),
                written.strike);
  return absl::OkStatus();
}

}  // namespace carillon::cli
