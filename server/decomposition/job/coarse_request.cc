// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job/coarse_request.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "proto/cpp/limits.h"
#include "proto/cpp/mesh_format.h"
#include "server/decomposition/job/memory_estimate.h"
#include "server/mode_database/model_store.h"

namespace carillon {
namespace {

constexpr uint32_t kCoarseCornerCount = 300;
/// Meshes with more corners than this take long with quadratic elements.
constexpr double kFineSurface = 1500;

std::string CoarseLabel(const std::string& label) {
  const std::string coarse = absl::StrCat(label, " (coarse)");
  return label.empty() || coarse.size() > kMaxLabelBytes ? "" : coarse;
}

}  // namespace

std::optional<v1::CreateModalModelRequest> CoarseRequest(
    const v1::CreateModalModelRequest& resolved, uint64_t mesh_bytes) {
  if (!resolved.coarse_first()) return std::nullopt;
  const MeshFormat* format = FindMeshFormat(resolved.mesh_format());
  if (format == nullptr || !format->is_surface) return std::nullopt;
  const uint32_t asked = resolved.settings().mesh().target_node_count();
  if (asked > 0 && asked <= kCoarseCornerCount) return std::nullopt;
  v1::CreateModalModelRequest coarse = resolved;
  coarse.set_coarse_first(false);
  coarse.set_without_transfer(true);
  coarse.set_label(CoarseLabel(resolved.label()));
  v1::MeshSettings& mesh = *coarse.mutable_settings()->mutable_mesh();
  mesh.clear_accuracy();
  mesh.clear_budget_s();
  mesh.clear_budget_gib();
  mesh.clear_target_node_count();
  // No mesh has fewer nodes than its surface.
  coarse.mutable_settings()->set_element(v1::ELEMENT_LINEAR);
  const bool fine_surface = GuessNodeCount(coarse, mesh_bytes) > kFineSurface;
  if (!fine_surface) coarse.mutable_settings()->set_element(resolved.settings().element());
  if (fine_surface && resolved.settings().element() == v1::ELEMENT_LINEAR) return std::nullopt;
  mesh.set_target_node_count(kCoarseCornerCount);
  return coarse;
}

bool IsCoarseOf(const v1::ModalModelHeader& header, const v1::CreateModalModelRequest& resolved) {
  const auto count = [](const v1::DecompositionSettings& settings) {
    return settings.mesh().target_node_count();
  };
  return count(header.settings()) == kCoarseCornerCount &&
         count(resolved.settings()) != kCoarseCornerCount;
}

}  // namespace carillon
