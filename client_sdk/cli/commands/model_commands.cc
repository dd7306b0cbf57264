// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/strip.h"
#include "absl/time/time.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/commands/find_model.h"
#include "client_sdk/cli/output/job_progress.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/fixture_text.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/mesh_file.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

// As the daemon has them: how far the speed of sound of a material may be from that of a transfer,
// and its Poisson's ratio from that of a model.
constexpr double kSpeedTolerance = 0.05;
constexpr double kPoissonTolerance = 1.0001e-4;

std::string Format(const CreateModelOptions& options, const std::string& file) {
  return options.format.empty() ? MeshFormatOf(file) : options.format;
}

std::string LabelOf(const CreateModelOptions& options, const std::string& file) {
  return options.label.empty() ? std::filesystem::path(file).stem().string() : options.label;
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

const char* ElementName(v1::Element element) {
  return element == v1::ELEMENT_LINEAR ? "linear" : "quadratic";
}

void PrintWarningLines(const google::protobuf::RepeatedPtrField<std::string>& warnings) {
  for (const std::string& warning : warnings) {
    absl::PrintF("warning    %s\n", EscapedText(warning));
  }
}

void PrintTransfer(const v1::TransferSummary& transfer) {
  const v1::TransferHeader& header = transfer.header();
  absl::PrintF(
      "transfer   for materials with a speed of sound near %.0f m/s: %d of %s, "
      "the worst within %.1f dB, %s\n",
      header.speed_ratio() * header.sound_speed_m_per_s(), header.computed_mode_count(),
      Counted(header.wanted_mode_count(), "mode"), header.verification().max_power_error_db(),
      Counted(transfer.stored_bytes(), "byte"));
  PrintWarningLines(header.warnings());
}

void PrintSummary(const v1::ModalModelSummary& model) {
  const v1::ModalModelHeader& header = model.header();
  const v1::Verification& proof = header.verification();
  absl::PrintF("%s\n", model.name());
  absl::PrintF("label      %s\n", EscapedText(model.label()));
  absl::PrintF("modes      %d, with %d rigid; Sturm count %d\n", header.mode_count(),
               proof.rigid_mode_count(), proof.sturm_count());
  absl::PrintF("mesh       %s, %d %s tetrahedra, volume %.6g m^3\n",
               Counted(header.node_count(), "node"), header.element_count(),
               ElementName(header.settings().element()), header.volume_m3());
  absl::PrintF("poisson    %.4f\n", header.settings().poisson_ratio());
  if (model.has_material()) absl::PrintF("material   %s\n", MaterialText(model.material()));
  for (const v1::Fixture& fixture : header.settings().fixtures()) {
    absl::PrintF("fixed      %s\n", FixtureText(fixture).value_or("?"));
  }
  absl::PrintF("residual   %.2g at most, orthogonality %.2g\n", proof.max_residual(),
               proof.max_orthogonality_error());
  absl::PrintF("stored     %s by %s\n", Counted(model.stored_bytes(), "byte"), header.solver());
  if (header.estimated_errors_size() > 0) {
    absl::PrintF("accuracy   %.2g %%, as estimated of the worst mode\n",
                 100 * *std::ranges::max_element(header.estimated_errors()));
  }
  for (const v1::TransferSummary& transfer : model.transfers()) PrintTransfer(transfer);
  PrintWarningLines(header.warnings());
}

void PrintRow(const v1::ModalModelSummary& model) {
  const absl::string_view digest = absl::StripPrefix(model.name(), "modalModels/");
  absl::PrintF("%s  %10s  %13s  %-9s  %8.1f MiB  %s  %s\n", digest.substr(0, 12),
               Counted(model.header().mode_count(), "mode"),
               Counted(model.header().node_count(), "node"),
               ElementName(model.header().settings().element()),
               static_cast<double>(model.stored_bytes()) / (1 << 20),
               absl::FormatTime("%Y-%m-%d %H:%M", absl::FromUnixMillis(model.created_unix_ms()),
                                absl::LocalTimeZone()),
               EscapedText(model.label()));
}

/// Returns the transfer with which an object of `material` sounds, or null if none fits.
const v1::TransferSummary* FittingTransfer(const v1::ModalModelSummary& model,
                                           const v1::Material& material) {
  const double speed_m_per_s = std::sqrt(material.young_pa() / material.density_kg_per_m3());
  const v1::TransferSummary* nearest = nullptr;
  double least = kSpeedTolerance;
  for (const v1::TransferSummary& transfer : model.transfers()) {
    const v1::TransferHeader& header = transfer.header();
    const double distance =
        std::abs(std::log(speed_m_per_s / (header.speed_ratio() * header.sound_speed_m_per_s())));
    if (distance > least || transfer.power_integrals_size() != model.eigenvalues_size()) continue;
    least = distance;
    nearest = &transfer;
  }
  return nearest;
}

/// Prints the frequencies and decay rates of the modes for `material`, with Lambda = eigenvalue
/// E/rho, and the decay by radiation, rho_air Lambda I / (2 c rho), where a transfer fits.
void PrintModes(const v1::ModalModelSummary& model, const v1::Material& material) {
  const v1::TransferSummary* const transfer = FittingTransfer(model, material);
  absl::PrintF("\n%5s %14s %14s %12s", "mode", "natural Hz", "damped Hz", "material 1/s");
  if (transfer == nullptr) {
    absl::PrintF("  %s\n", "T60 s by the material alone");
  } else {
    absl::PrintF(" %13s %9s\n", "radiation 1/s", "T60 s");
  }
  for (int i = 0; i < model.eigenvalues_size(); ++i) {
    const double lambda = model.eigenvalues(i) * material.young_pa() / material.density_kg_per_m3();
    const double natural_hz = std::sqrt(lambda) / (2 * std::numbers::pi);
    const double by_material = DecayRatePerS(material, natural_hz);
    double sigma = by_material;
    std::string by_radiation;
    if (transfer != nullptr) {
      const v1::TransferHeader& air = transfer->header();
      const double radiated = air.air_density_kg_per_m3() * lambda * transfer->power_integrals(i) /
                              (2 * air.sound_speed_m_per_s() * material.density_kg_per_m3());
      by_radiation = absl::StrFormat(" %13.4f", radiated);
      sigma += radiated;
    }
    const double damped = std::sqrt(std::fmax(0, lambda - sigma * sigma));
    absl::PrintF("%5d %14.3f %14.3f %12.4f%s %9.3f\n", i + 1, natural_hz,
                 damped / (2 * std::numbers::pi), by_material, by_radiation,
                 std::log(1000) / sigma);
  }
}

/// Prints up to where the model has all modes of a body of `material`.
void PrintBand(const v1::ModalModelSummary& model, const v1::Material& material) {
  const v1::ModalModelHeader& header = model.header();
  const double lambda =
      header.complete_to_eigenvalue() * material.young_pa() / material.density_kg_per_m3();
  absl::PrintF("band       all modes up to %.5g Hz", std::sqrt(lambda) / (2 * std::numbers::pi));
  if (header.lowered_from_mode_count() > 0) {
    absl::PrintF(", lowered from some %s below 20 kHz",
                 Counted(header.lowered_from_mode_count(), "mode"));
  }
  absl::PrintF("\n");
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

/// Whether a command waits for its job, and how it prints it.
struct Conclusion {
  bool wait;
  bool json;
  /// Returns the name that the command prints if it prints no JSON.
  const std::string& (v1::Job::*name)() const;
};

absl::Status Conclude(const client::Client& daemon, absl::StatusOr<v1::Job> job,
                      const Conclusion& conclusion) {
  if (job.ok() && conclusion.wait) job = WatchWithProgress(daemon, job->name());
  if (!job.ok()) return job.status();
  if (conclusion.json) {
    PrintJson(*job);
  } else {
    absl::PrintF("%s\n", ((*job).*conclusion.name)());
  }
  return absl::OkStatus();
}

bool HelpsToRepair(const v1::Remedy& remedy) { return remedy.field() == "settings.mesh.repair"; }

/// Waits for the job of one file. A surface that is refused, and that repair may help, is asked for
/// again with repair; where that fails, too, its refusal is returned, which also names the first.
absl::StatusOr<v1::Job> AwaitModel(const client::Client& daemon, const CreateModelOptions& options,
                                   const std::string& file, const std::string& job) {
  absl::StatusOr<v1::Job> ended = WatchWithProgress(daemon, job);
  const v1::ErrorInfo refusal = ended.ok() ? v1::ErrorInfo() : ToErrorInfo(ended.status());
  if (!options.may_repair || std::ranges::none_of(refusal.remedies(), HelpsToRepair)) return ended;
  absl::FPrintF(stderr, "carillon: %s is asked for again with --repair: %s: %s\n", file,
                refusal.reason(), refusal.message());
  CreateModelOptions repairing = options;
  repairing.settings.mutable_mesh()->set_repair(true);
  absl::StatusOr<v1::Job> repaired = RequestModel(daemon, repairing, file);
  if (repaired.ok()) repaired = WatchWithProgress(daemon, repaired->name());
  return repaired;
}

/// Prints how a user sees whether a job that nobody waits for fails.
void PrintHowToFollow(const v1::Job& job) {
  absl::FPrintF(stderr, "carillon: %s is being computed; follow it with: carillon job watch %s\n",
                EscapedText(job.label()), ShortName(job));
}

/// Prints what the user should know about a model that was just made, or was there before.
void PrintWarnings(const client::Client& daemon, const std::string& name,
                   const std::string& wanted_label) {
  const auto model = daemon.GetModalModel(name);
  if (!model.ok()) return;
  for (const std::string& warning : model->header().warnings()) {
    absl::FPrintF(stderr, "warning: %s\n", EscapedText(warning));
  }
  const std::string other = OtherLabel(*model, wanted_label);
  if (!other.empty()) absl::FPrintF(stderr, "warning: %s\n", EscapedText(other));
}

double SoundSpeed(const v1::Material& resolved) {
  return std::sqrt(resolved.young_pa() / resolved.density_kg_per_m3());
}

/// Warns if no object of `material` can have the model, which was made for another Poisson's ratio,
/// and if objects of the model's own material will not sound by a transfer for this one.
void WarnOfMaterial(const v1::ModalModelSummary& model, const v1::Material& material) {
  const absl::StatusOr<v1::Material> wanted = ResolveMaterial(material);
  if (!wanted.ok()) return;  // the daemon says why
  const double poisson = model.header().settings().poisson_ratio();
  if (wanted->has_poisson_ratio() &&
      std::abs(wanted->poisson_ratio() - poisson) > kPoissonTolerance) {
    absl::FPrintF(
        stderr,
        "warning: the material's Poisson's ratio is %.4g, and the model was made for %.4g: "
        "no object of this material can have the model; give --poisson %.9g here and to "
        "its objects, or create a model for the material\n",
        wanted->poisson_ratio(), poisson, poisson);
  }
  const absl::StatusOr<v1::Material> own = ResolveMaterial(model.material());
  if (!model.has_material() || !own.ok()) return;
  if (std::abs(std::log(SoundSpeed(*own) / SoundSpeed(*wanted))) > kSpeedTolerance) {
    absl::FPrintF(
        stderr,
        "warning: the model was made of %s, with another speed of sound: objects that name "
        "no material of their own do not sound by this transfer\n",
        MaterialText(model.material()));
  }
}

/// Removes what a list of models need not tell; `carillon model show` tells it.
void Shorten(v1::ModalModelSummary& model) {
  model.mutable_header()->clear_settings();
  model.mutable_header()->clear_verification();
  model.mutable_header()->clear_arrays();
  model.mutable_header()->clear_estimated_errors();
}

}  // namespace

absl::Status CreateModel(const client::Client& daemon, const CreateModelOptions& options,
                         bool json) {
  // All are requested before the first is waited for, so that they are computed side by side.
  std::vector<absl::StatusOr<v1::Job>> jobs;
  for (const std::string& file : options.files) {
    jobs.push_back(RequestModel(daemon, options, file));
  }
  absl::Status first_error;
  for (size_t i = 0; i < jobs.size(); ++i) {
    absl::StatusOr<v1::Job> job = std::move(jobs[i]);
    if (job.ok() && options.wait) job = AwaitModel(daemon, options, options.files[i], job->name());
    if (job.ok() && job->state() == v1::JOB_STATE_SUCCEEDED) {
      PrintWarnings(daemon, job->modal_model(), LabelOf(options, options.files[i]));
    }
    if (job.ok() && job->state() != v1::JOB_STATE_SUCCEEDED) PrintHowToFollow(*job);
    const absl::Status ended = Conclude(
        daemon, std::move(job), {.wait = false, .json = json, .name = &v1::Job::modal_model});
    if (ended.ok()) continue;
    if (!first_error.ok()) (void)Report(first_error);
    first_error = ended;
  }
  return first_error;
}

absl::Status CreateTransfer(const client::Client& daemon, const CreateTransferOptions& options,
                            bool json) {
  ASSIGN_OR_RETURN(const auto model, FindModel(daemon, options.model));
  ASSIGN_OR_RETURN(const auto material, ToMaterial(options.material));
  if (const auto stored = daemon.GetModalModel(model); stored.ok()) {
    WarnOfMaterial(*stored, material);
  }
  v1::CreateTransferRequest request;
  request.set_modal_model(model);
  *request.mutable_material() = material;
  request.set_size(options.size);
  request.mutable_settings()->set_accuracy_db(options.accuracy_db);
  request.mutable_settings()->set_budget_s(options.budget_s);
  return Conclude(daemon, daemon.CreateTransfer(request),
                  {.wait = options.wait, .json = json, .name = &v1::Job::name});
}

absl::Status ListModels(const client::Client& daemon, const v1::ListModalModelsRequest& filter,
                        bool json) {
  v1::ListModalModelsResponse list;
  if (filter.page_size() > 0) {
    ASSIGN_OR_RETURN(list, daemon.ListModalModelsPage(filter));
  } else {
    ASSIGN_OR_RETURN(auto models, daemon.ListModalModels(filter));
    for (auto& model : models) *list.add_modal_models() = std::move(model);
  }
  if (json) {
    for (v1::ModalModelSummary& model : *list.mutable_modal_models()) Shorten(model);
    PrintJson(list);
    return absl::OkStatus();
  }
  if (list.modal_models().empty()) PrintNothing("model");
  for (const auto& model : list.modal_models()) PrintRow(model);
  if (!list.next_page_token().empty()) {
    absl::PrintF("more with --page-token %s\n", list.next_page_token());
  }
  return absl::OkStatus();
}

absl::Status ShowModel(const client::Client& daemon, const std::string& text,
                       const MaterialFigures& figures, bool json) {
  ASSIGN_OR_RETURN(const auto name, FindModel(daemon, text));
  ASSIGN_OR_RETURN(const auto model, daemon.GetModalModel(name));
  if (json) {
    PrintJson(model);
    return absl::OkStatus();
  }
  ASSIGN_OR_RETURN(const auto given, ToMaterial(figures));
  const bool is_given = !given.preset().empty() || given.has_young_pa();
  const v1::Material& chosen = is_given ? given : model.material();
  const bool has_material = is_given || model.has_material();
  ASSIGN_OR_RETURN(const auto material, has_material ? ResolveMaterial(chosen) : chosen);
  PrintSummary(model);
  if (has_material) PrintBand(model, material);
  if (has_material) PrintModes(model, material);
  return absl::OkStatus();
}

absl::Status DeleteModels(const client::Client& daemon, const std::vector<std::string>& texts,
                          bool json) {
  absl::Status first_error;
  for (const std::string& text : texts) {
    const auto name = FindModel(daemon, text);
    const absl::Status ended = name.ok() ? daemon.DeleteModalModel(*name) : name.status();
    if (!ended.ok()) {
      if (!first_error.ok()) (void)Report(first_error);
      first_error = ended;
    } else if (json) {
      PrintJson({{"modal_model", *name}});
    } else if (texts.size() > 1) {
      absl::PrintF("%s deleted\n", *name);
    }
  }
  return first_error;
}

absl::Status WatchJob(const client::Client& daemon, const std::string& text, bool json) {
  ASSIGN_OR_RETURN(const auto name, FindJob(daemon, text));
  ASSIGN_OR_RETURN(const auto job, WatchWithProgress(daemon, name));
  if (json) {
    PrintJson(job);
  } else {
    absl::PrintF("%s\n", job.modal_model());
  }
  return absl::OkStatus();
}

}  // namespace carillon::cli
