// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/remedies.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_format.h"
#include "precompute/modes/deformation_modes.h"
#include "precompute/pipeline/worker_request.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

/// A refused request.
struct Refused {
  const worker::v1::WorkerRequest& request;
  v1::ErrorInfo error;

  /// Returns a figure of the refusal, or `otherwise` if the refusal has none of this name.
  double Figure(const char* name, double otherwise = 0) const {
    const auto found = error.metadata().find(name);
    double value = 0;
    const bool has = found != error.metadata().end() && absl::SimpleAtod(found->second, &value);
    return has ? value : otherwise;
  }
};

/// Returns a value with two digits, or an empty string, which leaves the choice to the caller.
std::string InTwoDigits(double value) {
  return std::isfinite(value) && value > 0 ? absl::StrFormat("%.2g", value) : "";
}

/// Returns a whole number of two digits that are not zero, such as 3200, or an empty string for a
/// value below one. `round` is std::round, std::floor or std::ceil.
std::string RoundedWhole(double value, double (*round)(double) = std::round) {
  if (!(value >= 1)) return "";
  const double unit = std::pow(10, std::max(0.0, std::floor(std::log10(value)) - 1));
  return absl::StrFormat("%.0f", unit * round(value / unit));
}

/// A mode lies surely in a band, whatever mesh it is computed on, if it is by this factor inside.
constexpr double kInside = 1.002;

/// The lower end of the band that an option with the upper end alone means.
constexpr double kUsualLowestHz = 20;

double TopOfBandHz(const worker::v1::WorkerRequest& request) { return UseOf(request).high_hz; }

double SizeOf(const worker::v1::WorkerRequest& request) {
  return request.size() > 0 ? request.size() : 1;
}

/// A wall of this part of the body's diagonal is thin, and thick enough to be meshed.
constexpr double kWallPart = 0.02;
constexpr double kCoarseNodeCount = 5000;
/// Processor time in seconds that a first budget allows.
constexpr double kFirstBudget = 120;

/// Returns the nearest size, rounded away, with which the first mode lies in the band, or an empty
/// string if rounding it moves the mode out of a narrow band.
std::string SizeInBand(const Refused& refused) {
  const double low_hz = refused.request.min_frequency_hz(), high_hz = TopOfBandHz(refused.request);
  const bool is_low = refused.Figure("first_mode_hz") <= low_hz;
  const double at_size_one = SizeOf(refused.request) * refused.Figure("first_mode_hz");
  for (const int digits : {2, 4}) {
    const double limit = at_size_one / (is_low ? kInside * low_hz : high_hz / kInside);
    const double unit = std::pow(10, std::floor(std::log10(limit)) + 1 - digits);
    const double size = unit * (is_low ? std::floor(limit / unit) : std::ceil(limit / unit));
    const double first_hz = at_size_one / size;
    if (first_hz > low_hz && first_hz < high_hz) return absl::StrFormat("%.*g", digits, size);
  }
  return "";
}

/// Returns an upper end of the band below which few enough modes were counted.
std::string LowerBand(const Refused& refused) {
  const double eigenvalue = refused.Figure("lower_eigenvalue");
  const std::string band = RoundedWhole(UseOf(refused.request).FrequencyHz(eigenvalue), std::floor);
  double high_hz = 0;
  const bool is_band = absl::SimpleAtod(band, &high_hz) &&
                       high_hz > std::max(refused.request.min_frequency_hz(), kUsualLowestHz);
  return is_band ? band : "";
}

/// Whether the solver can find all the modes that were counted, and they are modes of the body and
/// not of its mesh.
bool CanFindAll(const Refused& refused) {
  constexpr double kMostOfUnknowns = 0.25;
  const double count = refused.Figure("mode_count");
  return count <= kMaxFoundModeCount && count <= kMostOfUnknowns * refused.Figure("unknown_count");
}

/// A change, and whether it cannot help or a request has been changed so already.
struct Known {
  const char* field;
  const char* option;
  const char* effect;
  /// Returns the value to set, as text.
  std::string (*value)(const Refused& refused);
  bool (*useless)(const Refused& refused);
};

bool Never(const Refused& /*refused*/) { return false; }

constexpr Known kRepair{"settings.mesh.repair", "--repair",
                        "repairs the surface, where possible without a change of shape",
                        [](const Refused&) -> std::string { return "true"; },
                        [](const Refused& r) {
                          return r.request.settings().mesh().repair() ||
                                 r.Figure("narrowness") > 0 || r.Figure("repair_helps", 1) == 0;
                        }};
constexpr Known kWall{
    "settings.mesh.wall_m", "--wall",
    "makes a body of an open sheet by a wall of this thickness in metres",
    [](const Refused& refused) { return InTwoDigits(kWallPart * refused.Figure("extent_m")); },
    [](const Refused& r) {
      return r.request.settings().mesh().wall_m() > 0 || r.Figure("wall_helps", 1) == 0;
    }};
constexpr Known kThinnerWall{"settings.mesh.wall_m", "--wall",
                             "asks for a wall of half the thickness, in metres",
                             [](const Refused& refused) {
                               return InTwoDigits(refused.request.settings().mesh().wall_m() / 2);
                             },
                             Never};
constexpr Known kSolid{"settings.mesh.wall_m", "--wall", "fills the body without a wall",
                       [](const Refused&) -> std::string { return "0"; },
                       [](const Refused& r) { return r.Figure("open") > 0; }};
constexpr Known kBand{
    "max_frequency_hz", "--band", "leaves out the modes of the band's upper half",
    [](const Refused& refused) { return RoundedWhole(TopOfBandHz(refused.request) / 2); }, Never};
constexpr Known kOpenBand{"max_frequency_hz", "--band",
                          "computes as many of the lowest modes as fit",
                          [](const Refused&) -> std::string { return "0"; },
                          [](const Refused& r) { return r.request.max_frequency_hz() == 0; }};
constexpr Known kKeep{
    "settings.keep_mode_count", "--keep", "keeps the most audible modes only",
    [](const Refused&) -> std::string { return "2000"; },
    [](const Refused& r) { return r.request.settings().keep_mode_count() > 0 || !CanFindAll(r); }};
constexpr Known kCountedBand{"max_frequency_hz", "--band",
                             "leaves out the modes above this frequency", LowerBand,
                             [](const Refused& r) { return LowerBand(r).empty(); }};
constexpr Known kNodes{"settings.mesh.target_node_count", "--nodes",
                       "meshes the body with fewer nodes",
                       [](const Refused& refused) {
                         const double asked = refused.request.settings().mesh().target_node_count();
                         return RoundedWhole(asked > 0 ? asked / 2 : kCoarseNodeCount);
                       },
                       [](const Refused& r) { return r.Figure("narrowness") > 0; }};
constexpr Known kAccuracy{
    "settings.mesh.accuracy", "--accuracy", "refines the mesh until the frequencies are this exact",
    [](const Refused&) -> std::string { return "0.01"; },
    [](const Refused& r) { return r.request.settings().mesh().accuracy() > 0; }};
constexpr Known kBudget{"settings.mesh.budget_s", "--budget",
                        "refines the mesh as far as this processor time in seconds allows",
                        [](const Refused& refused) {
                          const double asked = refused.request.settings().mesh().budget_s();
                          return RoundedWhole(asked > 0 ? 2 * asked : kFirstBudget);
                        },
                        Never};
constexpr Known kSize{"size", "--size",
                      "makes the body so large that its first mode lies in the band", SizeInBand,
                      [](const Refused& r) { return SizeInBand(r).empty(); }};
constexpr Known kHigherBand{
    "max_frequency_hz", "--band", "reaches the first mode; a higher end finds more modes",
    [](const Refused& refused) {
      return RoundedWhole(1.05 * refused.Figure("first_mode_hz"), std::ceil);
    },
    [](const Refused& r) {
      const double first_hz = r.Figure("first_mode_hz");
      return first_hz < std::max(r.request.min_frequency_hz(), kUsualLowestHz);
    }};
constexpr Known kMetres{"settings.metres_per_unit", "--unit", "reads the file's lengths as metres",
                        [](const Refused&) -> std::string { return "1"; },
                        [](const Refused& r) {
                          const double unit_m = r.request.settings().metres_per_unit();
                          return unit_m == 0 || unit_m == 1;
                        }};

constexpr Known kMillimetres{"settings.metres_per_unit", "--unit",
                             "reads the file's lengths as millimetres",
                             [](const Refused&) -> std::string { return "0.001"; }, Never};
constexpr Known kMetresIndeed{"settings.metres_per_unit", "--unit",
                              "computes the body as long as it is in metres",
                              [](const Refused&) -> std::string { return "1"; }, Never};

std::vector<Known> RemediesOf(const std::string& reason) {
  if (reason == "MESH_NOT_CLOSED") return {kRepair, kWall};
  for (const char* faulty :
       {"MESH_NOT_MANIFOLD", "MESH_NOT_ORIENTED", "MESH_ZERO_VOLUME", "MESH_DEGENERATE_TRIANGLE",
        "MESH_DUPLICATE_SHELL", "MESH_SELF_INTERSECTING"}) {
    if (reason == faulty) return {kRepair};
  }
  if (reason == "MESH_REPAIR_FAILED") return {kWall};
  if (reason == "MESH_UNIT_UNCLEAR") return {kMillimetres, kMetresIndeed};
  if (reason == "MESH_WALL_IMPOSSIBLE") return {kThinnerWall, kSolid};
  if (reason == "MESH_TETRAHEDRALIZATION_FAILED") return {kNodes, kRepair};
  if (reason == "TOO_MANY_MODES") return {kOpenBand, kKeep, kCountedBand};
  if (reason == "MEMORY_TOO_SMALL" || reason == "OUT_OF_MEMORY") return {kOpenBand, kBand, kNodes};
  if (reason == "ACCURACY_NOT_REACHED") return {kAccuracy, kBudget};
  if (reason == "NO_MODE_IN_BAND") return {kHigherBand, kSize, kMetres};
  return {};
}

}  // namespace

absl::Status WithRemedies(absl::Status refusal, const worker::v1::WorkerRequest& request) {
  const Refused refused{request, ToErrorInfo(refusal)};
  for (const Known& known : RemediesOf(refused.error.reason())) {
    if (known.useless(refused)) continue;
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
