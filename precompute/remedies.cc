// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/remedies.h"

#include <string>
#include <vector>

#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

/// A change, and whether a request has been changed so already.
struct Known {
  const char* field;
  const char* value;
  const char* option;
  const char* effect;
  bool (*present)(const v1::WorkerRequest& request);
};

bool Never(const v1::WorkerRequest& /*request*/) { return false; }

constexpr Known kRepair{"settings.mesh.repair", "true", "--repair",
                        "repairs the surface, where possible without a change of shape",
                        [](const v1::WorkerRequest& r) { return r.settings().mesh().repair(); }};
constexpr Known kWall{"settings.mesh.wall_m", "", "--wall",
                      "makes a body of an open sheet by a wall of this thickness",
                      [](const v1::WorkerRequest& r) { return r.settings().mesh().wall_m() > 0; }};
constexpr Known kThinnerWall{"settings.mesh.wall_m", "", "--wall",
                             "asks for another thickness of the wall", Never};
constexpr Known kSolid{"settings.mesh.wall_m", "0", "--wall", "fills the body without a wall",
                       Never};
constexpr Known kBand{"max_frequency_hz", "", "--band",
                      "leaves out the modes above a lower frequency", Never};
constexpr Known kOpenBand{"max_frequency_hz", "0", "--band",
                          "computes as many of the lowest modes as fit",
                          [](const v1::WorkerRequest& r) { return r.max_frequency_hz() == 0; }};
constexpr Known kKeep{
    "settings.keep_mode_count", "2000", "--keep", "keeps the most audible modes only",
    [](const v1::WorkerRequest& r) { return r.settings().keep_mode_count() > 0; }};
constexpr Known kNodes{"settings.mesh.target_node_count", "", "--nodes",
                       "meshes the body with another number of nodes", Never};
constexpr Known kAccuracy{
    "settings.mesh.accuracy", "0.01", "--accuracy",
    "refines the mesh until the frequencies are this exact",
    [](const v1::WorkerRequest& r) { return r.settings().mesh().accuracy() > 0; }};
constexpr Known kBudget{"settings.mesh.budget_s", "", "--budget",
                        "refines the mesh as far as this processor time and memory allow", Never};
constexpr Known kSize{"size", "", "--size", "changes the size that the body sounds with", Never};
constexpr Known kHigherBand{"max_frequency_hz", "", "--band", "looks for modes in a higher band",
                            Never};
constexpr Known kMetres{"settings.metres_per_unit", "1", "--unit",
                        "reads the file's lengths as metres", [](const v1::WorkerRequest& r) {
                          return r.settings().metres_per_unit() == 0 ||
                                 r.settings().metres_per_unit() == 1;
                        }};

std::vector<Known> RemediesOf(const std::string& reason) {
  if (reason == "MESH_NOT_CLOSED") return {kRepair, kWall};
  for (const char* faulty :
       {"MESH_NOT_MANIFOLD", "MESH_NOT_ORIENTED", "MESH_ZERO_VOLUME", "MESH_DEGENERATE_TRIANGLE",
        "MESH_DUPLICATE_SHELL", "MESH_SELF_INTERSECTING"}) {
    if (reason == faulty) return {kRepair};
  }
  if (reason == "MESH_REPAIR_FAILED") return {kWall};
  if (reason == "MESH_WALL_IMPOSSIBLE") return {kThinnerWall, kSolid};
  if (reason == "MESH_TETRAHEDRALIZATION_FAILED") return {kNodes, kRepair};
  if (reason == "TOO_MANY_MODES") return {kOpenBand, kKeep, kBand};
  if (reason == "MEMORY_TOO_SMALL" || reason == "OUT_OF_MEMORY") return {kOpenBand, kBand, kNodes};
  if (reason == "ACCURACY_NOT_REACHED") return {kAccuracy, kBudget, kNodes};
  if (reason == "NO_MODE_IN_BAND") return {kHigherBand, kSize, kMetres};
  return {};
}

}  // namespace

absl::Status WithRemedies(absl::Status refusal, const v1::WorkerRequest& request) {
  for (const Known& known : RemediesOf(ToErrorInfo(refusal).reason())) {
    if (known.present(request)) continue;
    v1::Remedy remedy;
    remedy.set_field(known.field);
    remedy.set_value(known.value);
    remedy.set_option(known.option);
    remedy.set_effect(known.effect);
    AddRemedy(refusal, remedy);
  }
  return refusal;
}

}  // namespace carillon::precompute
