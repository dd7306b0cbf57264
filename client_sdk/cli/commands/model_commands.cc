// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/strip.h"
#include "absl/time/time.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/commands/find_model.h"
#include "client_sdk/cli/commands/mode_sound.h"
#include "client_sdk/cli/output/job_progress.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/fixture_text.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/mesh_file.h"
#include "proto/cpp/poisson_change.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

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

/// Prints the frequencies and decay rates of the modes, and the decay by radiation where a transfer
/// fits.
void PrintModes(const std::vector<ModeSound>& modes) {
  const bool radiates = !modes.empty() && modes.front().radiation_decay_per_s.has_value();
  absl::PrintF("\n%5s %14s %14s %12s", "mode", "natural Hz", "damped Hz", "material 1/s");
  if (radiates) {
    absl::PrintF(" %13s %9s\n", "radiation 1/s", "T60 s");
  } else {
    absl::PrintF("  %s\n", "T60 s by the material alone");
  }
  for (size_t i = 0; i < modes.size(); ++i) {
    const ModeSound& mode = modes[i];
    const std::string by_radiation =
        radiates ? absl::StrFormat(" %13.4f", mode.radiation_decay_per_s.value_or(0)) : "";
    absl::PrintF("%5d %14.3f %14.3f %12.4f%s %9.3f\n", i + 1, mode.natural_hz, mode.damped_hz,
                 mode.material_decay_per_s, by_radiation, mode.T60());
  }
}

/// Prints up to where the model has all modes of a body of `material`.
void PrintBand(const v1::ModalModelSummary& model, const v1::Material& material) {
  const v1::ModalModelHeader& header = model.header();
  absl::PrintF("band       all modes up to %.5g Hz", CompleteToHz(model, material));
  if (header.lowered_from_mode_count() > 0) {
    absl::PrintF(", lowered from some %s below 20 kHz",
                 Counted(header.lowered_from_mode_count(), "mode"));
  }
  absl::PrintF("\n");
}

double SoundSpeed(const v1::Material& resolved) {
  return std::sqrt(resolved.young_pa() / resolved.density_kg_per_m3());
}

/// Warns if no object of `material` can have the model, which was made for another Poisson's ratio,
/// and if objects of the model's own material will not sound by a transfer for this one.
void WarnOfMaterial(const v1::ModalModelSummary& model, const v1::Material& material) {
  const absl::StatusOr<v1::Material> wanted = MatchedMaterial(model, material);
  if (!wanted.ok()) return;  // the daemon says why
  const double poisson = model.header().settings().poisson_ratio();
  if (wanted->has_poisson_ratio() &&
      !ServesPoissonRatio(poisson, wanted->poisson_ratio(),
                          model.header().poisson_slopes_size() > 0)) {
    absl::FPrintF(
        stderr,
        "warning: the material's Poisson's ratio is %.4g, and the model was made for %.4g: "
        "no object of this material can have the model; give --poisson %.9g here and to "
        "its objects, or create a model for the material\n",
        wanted->poisson_ratio(), poisson, poisson);
  }
  const absl::StatusOr<v1::Material> own = MatchedMaterial(model, model.material());
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
  model.mutable_header()->clear_poisson_slopes();
  model.mutable_header()->clear_regions();
  model.mutable_header()->clear_given_triangle_regions();
}

}  // namespace

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
  ASSIGN_OR_RETURN(v1::Job job, daemon.CreateTransfer(request));
  if (options.wait) {
    ASSIGN_OR_RETURN(job, WatchWithProgress(daemon, job.name()));
  }
  if (json) {
    PrintJson(job);
  } else {
    absl::PrintF("%s\n", job.name());
  }
  return absl::OkStatus();
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
  ASSIGN_OR_RETURN(const auto model, FindSummary(daemon, text));
  ASSIGN_OR_RETURN(const auto given, ToMaterial(figures));
  const bool is_given = given.ByteSizeLong() > 0;
  const v1::Material& chosen = is_given ? given : model.material();
  const bool has_material = is_given || model.has_material();
  ASSIGN_OR_RETURN(const auto material, has_material ? MatchedMaterial(model, chosen) : chosen);
  if (json) {
    std::vector<JsonMember> members;
    if (has_material) members = ModeMembers(ModesOf(model, material));
    if (has_material) members.push_back({"complete_to_hz", CompleteToHz(model, material)});
    absl::PrintF("%s\n", MessageJson(model, members));
    return absl::OkStatus();
  }
  PrintSummary(model);
  if (has_material) PrintBand(model, material);
  if (has_material) PrintModes(ModesOf(model, material));
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
