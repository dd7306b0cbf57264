// SPDX-License-Identifier: Apache-2.0
//
// The commands that move models from files into the daemon and back.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/strip.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/commands/find_model.h"
#include "client_sdk/cli/output/output.h"
#include "client_sdk/interchange/gltf_model.h"
#include "client_sdk/interchange/model_records.h"
#include "client_sdk/interchange/npz_model.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

using interchange::StoredModel;

bool IsDigest(const std::string& text) {
  return text.size() == 64 && std::ranges::all_of(text, [](unsigned char c) {
           return absl::ascii_isdigit(c) || (c >= 'a' && c <= 'f');
         });
}

/// "model", "glb", "gltf" or "npz".
std::string FormatOf(const std::string& file, const std::string& format) {
  if (!format.empty()) return format;
  const std::string suffix =
      absl::AsciiStrToLower(std::filesystem::path(file).extension().string());
  const bool known = suffix == ".glb" || suffix == ".gltf" || suffix == ".npz";
  return known ? suffix.substr(1) : "model";
}

bool IsGltf(const std::string& format) { return format == "glb" || format == "gltf"; }

bool IsGiven(const v1::Material& material) { return material.ByteSizeLong() > 0; }

/// Returns the material of the command line for an export, which only a glTF needs.
absl::StatusOr<v1::Material> MaterialFor(const std::string& format,
                                         const MaterialFigures& figures) {
  absl::StatusOr<v1::Material> material = ToMaterial(figures);
  if (!material.ok() || IsGltf(format) || !IsGiven(*material)) return material;
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                 absl::StrCat("a file of the format '", format,
                              "' holds a model for every material; leave the material out"));
}

absl::Status WriteGltf(const client::Client& daemon, const std::string& name,
                       const std::string& file, const v1::Material& given, bool binary) {
  ASSIGN_OR_RETURN(const v1::ModalModelSummary summary, daemon.GetModalModel(name));
  const v1::Material& chosen = IsGiven(given) ? given : summary.material();
  if (!IsGiven(chosen)) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   "a glTF holds the frequencies and decay rates of one material, and this model "
                   "was stored without one; give --material");
  }
  ASSIGN_OR_RETURN(v1::Material material, ResolveMaterial(chosen));
  if (!summary.header().regions().empty()) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   "a glTF holds a body of one material, and this model has several; export it "
                   "without a format, or as npz");
  }
  ASSIGN_OR_RETURN(const StoredModel model, Fetch(daemon, name));
  if (!material.has_poisson_ratio()) {
    material.set_poisson_ratio(model.header.settings().poisson_ratio());
  }
  return interchange::WriteGltfModel(
      file, model, material, {.body = summary.label(), .material = chosen.preset()}, binary);
}

absl::Status WriteNpz(const client::Client& daemon, const std::string& name,
                      const std::string& file) {
  ASSIGN_OR_RETURN(const StoredModel model, Fetch(daemon, name));
  return interchange::WriteNpz(file, model);
}

absl::StatusOr<v1::ModalModelSummary> Store(const client::Client& daemon, const StoredModel& model,
                                            const std::string& label) {
  const auto send = [&](const client::Client::RecordSink& sink) {
    return interchange::SendRecords(model, sink);
  };
  return daemon.ImportModalModel(send, "", label);
}

/// The result of an import.
struct Imported {
  v1::ModalModelSummary summary;
  v1::Material material;  ///< of the file, or of the command line; empty: neither has one
};

/// Returns the command-line options of a material.
std::string OptionsOf(const v1::Material& material) {
  std::string options =
      absl::StrFormat("--young %.9g --poisson %.9g --density %.9g --alpha1 %.9g --alpha2 %.9g",
                      material.young_pa(), material.poisson_ratio(), material.density_kg_per_m3(),
                      material.alpha1_s(), material.alpha2_per_s());
  const char* separator = " --loss-factor ";
  for (const v1::LossFactorPoint& point : material.loss_factor()) {
    absl::StrAppendFormat(&options, "%s%.9g:%.9g", separator, point.frequency_hz(),
                          point.loss_factor());
    separator = ",";
  }
  return options;
}

absl::StatusOr<Imported> ImportGltf(const client::Client& daemon, const ImportOptions& options,
                                    v1::Material material) {
  if (!material.preset().empty()) {
    ASSIGN_OR_RETURN(material, ResolveMaterial(material));
  }
  ASSIGN_OR_RETURN(const auto read,
                   interchange::ReadGltfModel(options.file, options.pick, material));
  ASSIGN_OR_RETURN(auto summary,
                   Store(daemon, read.model, options.label.empty() ? read.label : options.label));
  return Imported{.summary = std::move(summary), .material = read.material};
}

absl::StatusOr<Imported> ImportNpz(const client::Client& daemon, const ImportOptions& options,
                                   const v1::Material& material) {
  ASSIGN_OR_RETURN(const StoredModel model, interchange::ReadNpz(options.file));
  ASSIGN_OR_RETURN(auto summary, Store(daemon, model, options.label));
  return Imported{.summary = std::move(summary), .material = material};
}

/// Imports a file in the stored form. If its name is a digest, the model gets that name, because
/// the stored form rounds nothing.
absl::StatusOr<Imported> ImportStored(const client::Client& daemon, const ImportOptions& options,
                                      const v1::Material& material) {
  const std::string stem = std::filesystem::path(options.file).stem();
  const std::string name = IsDigest(stem) ? absl::StrCat("modalModels/", stem) : "";
  ASSIGN_OR_RETURN(auto summary, daemon.ImportModalModelFile(options.file, name, options.label));
  return Imported{.summary = std::move(summary), .material = material};
}

/// Sets the label of an imported model to that of the options, even if the daemon had stored the
/// model before with another label. Without that option, a model without a label gets the name of
/// its file, unless the name is a digest. The label stays as it is if the daemon does not let the
/// caller change it.
void Label(const client::Client& daemon, const ImportOptions& options,
           v1::ModalModelSummary& model) {
  std::string label = options.label;
  if (label.empty()) label = model.label();
  if (label.empty()) label = std::filesystem::path(options.file).stem();
  if (label == model.label() || (options.label.empty() && IsDigest(label))) return;
  v1::UpdateModalModelRequest request;
  request.set_name(model.name());
  request.set_label(label);
  absl::StatusOr<v1::ModalModelSummary> labelled = daemon.UpdateModalModel(request);
  if (labelled.ok()) model = *std::move(labelled);
}

/// Gives an imported model the material of the file or of the command line, which objects have that
/// name no material. The daemon refuses a material for which the model is not made.
absl::Status SetMaterial(const client::Client& daemon, bool is_asked_for, Imported& imported) {
  if (!IsGiven(imported.material)) {
    if (imported.summary.has_material()) return absl::OkStatus();
    absl::FPrintF(stderr,
                  "carillon: the file names no material, so objects must name one; or give "
                  "it to the model by `carillon model tag MODEL --material NAME`\n");
    return absl::OkStatus();
  }
  if (imported.material.preset().empty()) {
    absl::FPrintF(stderr, "carillon: the file's material is %s\n", OptionsOf(imported.material));
  }
  // A model that was stored before keeps its material, unless the user wants another.
  if (imported.summary.has_material() && !is_asked_for) return absl::OkStatus();
  v1::UpdateModalModelRequest request;
  request.set_name(imported.summary.name());
  *request.mutable_material() = imported.material;
  ASSIGN_OR_RETURN(imported.summary, daemon.UpdateModalModel(request));
  return absl::OkStatus();
}

}  // namespace

absl::Status ExportModel(const client::Client& daemon, const ExportOptions& options, bool json) {
  ASSIGN_OR_RETURN(const auto name, FindModel(daemon, options.model));
  const std::string format = FormatOf(options.file, options.format);
  ASSIGN_OR_RETURN(const auto material, MaterialFor(format, options.material));
  const std::string file = options.file.empty()
                               ? absl::StrCat(absl::StripPrefix(name, "modalModels/"), ".", format)
                               : options.file;
  RETURN_IF_ERROR(IsGltf(format)    ? WriteGltf(daemon, name, file, material, format == "glb")
                  : format == "npz" ? WriteNpz(daemon, name, file)
                                    : daemon.ExportModalModelFile(name, file));
  if (json) {
    PrintJson({{"file", file}, {"format", format}, {"modal_model", name}});
  } else {
    absl::PrintF("%s\n", file);
  }
  return absl::OkStatus();
}

absl::Status ImportModel(const client::Client& daemon, const ImportOptions& options, bool json) {
  const std::string format = FormatOf(options.file, options.format);
  ASSIGN_OR_RETURN(const auto material, ToMaterial(options.material));
  ASSIGN_OR_RETURN(auto imported, IsGltf(format)    ? ImportGltf(daemon, options, material)
                                  : format == "npz" ? ImportNpz(daemon, options, material)
                                                    : ImportStored(daemon, options, material));
  Label(daemon, options, imported.summary);
  RETURN_IF_ERROR(SetMaterial(daemon, IsGiven(material), imported));
  // To stderr, so that stdout is the name alone.
  for (const std::string& warning : imported.summary.header().warnings()) {
    absl::FPrintF(stderr, "carillon: %s\n", warning);
  }
  const std::string shared = SharedLabel(daemon, imported.summary);
  if (!shared.empty()) absl::FPrintF(stderr, "carillon: %s\n", shared);
  if (json) {
    PrintJson(imported.summary);
  } else {
    absl::PrintF("%s\n", imported.summary.name());
  }
  return absl::OkStatus();
}

}  // namespace carillon::cli
