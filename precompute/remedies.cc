// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/remedies.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_format.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

/// A refused request.
struct Refused {
  const v1::WorkerRequest& request;
  v1::ErrorInfo error;

  /// Returns a figure of the refusal, or zero if the refusal has none of this name.
  double Figure(const char* name) const {
    const auto found = error.metadata().find(name);
    double value = 0;
    if (found == error.metadata().end() || !absl::SimpleAtod(found->second, &value)) return 0;
    return value;
  }
};

/// Returns a value with two digits, or an empty string, which leaves the choice to the caller.
std::string Rounded(double value) {
  return std::isfinite(value) && value > 0 ? absl::StrFormat("%.2g", value) : "";
}

/// Returns a whole number of two digits that are not zero, such as 3200.
std::string RoundedWhole(double value) {
  if (!(value >= 1)) return "";
  const double unit = std::pow(10, std::max(0.0, std::floor(std::log10(value)) - 1));
  return absl::StrFormat("%.0f", unit * std::round(value / unit));
}

/// The upper end of the band that a request has where it states none.
constexpr double kUsualHighestHz = 20000;

double HighestHz(const v1::WorkerRequest& request) {
  return request.max_frequency_hz() > 0 ? request.max_frequency_hz() : kUsualHighestHz;
}

double SizeOf(const v1::WorkerRequest& request) { return request.size() > 0 ? request.size() : 1; }

/// A wall of this part of the body's diagonal is thin, and thick enough to be meshed.
constexpr double kWallPart = 0.02;
/// A body whose first mode lies here, or lower in the band, has most of its sound in the band.
constexpr double kAudibleHz = 1000;
constexpr double kCoarseNodeCount = 5000;
/// Processor time in seconds that a first budget allows.
constexpr double kFirstBudget = 120;

/// A change, and whether a request has been changed so already.
struct Known {
  const char* field;
  const char* option;
  const char* effect;
  /// Returns the value to set, as text.
  std::string (*value)(const Refused& refused);
  bool (*present)(const v1::WorkerRequest& request);
};

bool Never(const v1::WorkerRequest& /*request*/) { return false; }

constexpr Known kRepair{"settings.mesh.repair", "--repair",
                        "repairs the surface, where possible without a change of shape",
                        [](const Refused&) -> std::string { return "true"; },
                        [](const v1::WorkerRequest& r) { return r.settings().mesh().repair(); }};
constexpr Known kWall{
    "settings.mesh.wall_m", "--wall",
    "makes a body of an open sheet by a wall of this thickness in metres",
    [](const Refused& refused) { return Rounded(kWallPart * refused.Figure("extent_m")); },
    [](const v1::WorkerRequest& r) { return r.settings().mesh().wall_m() > 0; }};
constexpr Known kThinnerWall{
    "settings.mesh.wall_m", "--wall", "asks for a wall of half the thickness, in metres",
    [](const Refused& refused) { return Rounded(refused.request.settings().mesh().wall_m() / 2); },
    Never};
constexpr Known kSolid{"settings.mesh.wall_m", "--wall", "fills the body without a wall",
                       [](const Refused&) -> std::string { return "0"; }, Never};
constexpr Known kBand{
    "max_frequency_hz", "--band", "leaves out the modes of the band's upper half",
    [](const Refused& refused) { return RoundedWhole(HighestHz(refused.request) / 2); }, Never};
constexpr Known kOpenBand{"max_frequency_hz", "--band",
                          "computes as many of the lowest modes as fit",
                          [](const Refused&) -> std::string { return "0"; },
                          [](const v1::WorkerRequest& r) { return r.max_frequency_hz() == 0; }};
constexpr Known kKeep{
    "settings.keep_mode_count", "--keep", "keeps the most audible modes only",
    [](const Refused&) -> std::string { return "2000"; },
    [](const v1::WorkerRequest& r) { return r.settings().keep_mode_count() > 0; }};
constexpr Known kNodes{"settings.mesh.target_node_count", "--nodes",
                       "meshes the body with fewer nodes",
                       [](const Refused& refused) {
                         const double asked = refused.request.settings().mesh().target_node_count();
                         return RoundedWhole(asked > 0 ? asked / 2 : kCoarseNodeCount);
                       },
                       Never};
constexpr Known kAccuracy{
    "settings.mesh.accuracy", "--accuracy", "refines the mesh until the frequencies are this exact",
    [](const Refused&) -> std::string { return "0.01"; },
    [](const v1::WorkerRequest& r) { return r.settings().mesh().accuracy() > 0; }};
constexpr Known kBudget{"settings.mesh.budget_s", "--budget",
                        "refines the mesh as far as this processor time in seconds allows",
                        [](const Refused& refused) {
                          const double asked = refused.request.settings().mesh().budget_s();
                          return RoundedWhole(asked > 0 ? 2 * asked : kFirstBudget);
                        },
                        Never};
constexpr Known kSize{
    "size", "--size", "makes the body so large that its first modes lie in the band",
    [](const Refused& refused) {
      const double first_hz = std::min(kAudibleHz, HighestHz(refused.request) / 2);
      return Rounded(SizeOf(refused.request) * refused.Figure("first_mode_hz") / first_hz);
    },
    Never};
constexpr Known kHigherBand{
    "max_frequency_hz", "--band", "looks for modes up to four times the first",
    [](const Refused& refused) { return RoundedWhole(4 * refused.Figure("first_mode_hz")); },
    Never};
constexpr Known kMetres{"settings.metres_per_unit", "--unit", "reads the file's lengths as metres",
                        [](const Refused&) -> std::string { return "1"; },
                        [](const v1::WorkerRequest& r) {
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
  if (reason == "ACCURACY_NOT_REACHED") return {kAccuracy, kBudget};
  if (reason == "NO_MODE_IN_BAND") return {kHigherBand, kSize, kMetres};
  return {};
}

}  // namespace

absl::Status WithRemedies(absl::Status refusal, const v1::WorkerRequest& request) {
  const Refused refused{request, ToErrorInfo(refusal)};
  for (const Known& known : RemediesOf(refused.error.reason())) {
    if (known.present(request)) continue;
    v1::Remedy remedy;
    remedy.set_field(known.field);
    remedy.set_value(known.value(refused));
    remedy.set_option(known.option);
    remedy.set_effect(known.effect);
    AddRemedy(refusal, remedy);
  }
  return refusal;
}

}  // namespace carillon::precompute
