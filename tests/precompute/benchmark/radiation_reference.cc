// SPDX-License-Identifier: AGPL-3.0-or-later
//
// radiation_reference MODEL SPEED_RATIO ACCURACY_DB BUDGET_S EVERY GREATEST_VERTEX_COUNT
//
// Computes how the modes of a stored modal model radiate, in one thread, then every EVERY-th of
// them anew on a surface with edges half as long. Prints one JSON object. Modes whose finer surface
// would have more vertices than GREATEST_VERTEX_COUNT are not computed anew.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "precompute/codec/read_modal_model.h"
#include "precompute/radiation/far_pattern.h"
#include "precompute/radiation/solve_radiation.h"
#include "precompute/radiation/surface_levels.h"
#include "precompute/radiation/transfer.h"

namespace carillon::precompute {
namespace {

/// The greatest wavenumber of sounds that are heard: 20 kHz.
const double kGreatestWavenumber = 2 * std::numbers::pi * 20000 / Air().sound_speed_m_per_s;
constexpr double kReferenceTolerance = 3e-3;

template <class T>
T ValueOrExit(absl::StatusOr<T> result) {
  if (result.ok()) return *std::move(result);
  std::fprintf(stderr, "radiation_reference: %s\n", std::string(result.status().message()).c_str());
  std::exit(EXIT_FAILURE);
}

class Reference {
 public:
  Reference(const SurfaceModes& modes, const Transfer& transfer)
      : modes_(modes),
        transfer_(transfer),
        body_(FindRadiatingSurface(modes)),
        levels_(body_, workers_) {}

  /// The mode's true errors beside its stated ones; null where its finer surface is too large.
  nlohmann::json Check(size_t number, int most_vertices) {
    const ModeRadiation& mode = transfer_.modes[number];
    const int level = levels_.LevelOf(mode.edge_m) + 2;
    if (!levels_.Exists(level) || levels_.VertexCountOf(level) > most_vertices) return nullptr;
    const SphereGrid grid(PatternOrder(mode.wavenumber, body_.radius_m));
    const RemeshedSurface& surface = ValueOrExit(levels_.At(level))->level;
    const ModeField fine =
        SolveRadiation(ProblemOf(number, surface), surface, body_, grid, workers_).front();
    ModeField stored;
    stored.power_integral = mode.power_integral;
    stored.pattern = KeptPattern(mode, grid);
    return {{"vertices", mode.vertex_count},
            {"finer_vertices", surface.surface.vertex_count()},
            {"efficiency", mode.efficiency()},
            {"power_db", PowerDifferenceDb(stored, fine)},
            {"direction_db", DirectionDifferenceDb(stored.pattern, fine.pattern, grid)},
            {"stated_power_db", mode.power_error_db},
            {"stated_direction_db", mode.direction_error_db}};
  }

 private:
  ModeProblem ProblemOf(size_t number, const RemeshedSurface& level) const {
    ModeProblem problem{.wavenumber = transfer_.modes[number].wavenumber,
                        .displacements = {},
                        .starts = {},
                        .tolerance = kReferenceTolerance};
    problem.displacements.push_back(DisplacementOf(modes_, number, body_, level));
    return problem;
  }

  const SurfaceModes& modes_;
  const Transfer& transfer_;
  Workers workers_{1};
  RadiatingSurface body_;
  SurfaceLevels levels_;
};

nlohmann::json MeasureBody(const SurfaceModes& modes, const RadiationSettings& settings,
                           size_t every, int most_vertices) {
  const Transfer transfer = ValueOrExit(ComputeTransfer(modes, settings, [](double) {}));
  Reference reference(modes, transfer);
  nlohmann::json report = {{"checked", nlohmann::json::array()}};
  size_t computed = 0, too_large = 0;
  for (size_t m = 0; m < modes.mode_count(); ++m) {
    if (!transfer.modes[m].computed || computed++ % every != 0) continue;
    nlohmann::json checked = reference.Check(m, most_vertices);
    if (checked.is_null()) {
      ++too_large;
    } else {
      report["checked"].push_back(std::move(checked));
    }
  }
  report.update({{"computed", computed}, {"too_large", too_large}});
  return report;
}

}  // namespace
}  // namespace carillon::precompute

int main(int argc, char** argv) {
  namespace precompute = carillon::precompute;
  if (argc != 7) {
    std::fprintf(stderr,
                 "usage: radiation_reference MODEL SPEED_RATIO ACCURACY_DB BUDGET_S EVERY "
                 "GREATEST_VERTEX_COUNT\n");
    return EXIT_FAILURE;
  }
  const precompute::ModalModel model =
      precompute::ValueOrExit(precompute::ReadModalModel(argv[1])).model;
  const precompute::SurfaceModes modes{.vertices = model.vertices,
                                       .triangles = model.triangles,
                                       .eigenvalues = model.eigenvalues,
                                       .shapes = model.shapes};
  const precompute::RadiationSettings settings{
      .speed_ratio = std::atof(argv[2]),
      .air = {},
      .least_wavenumber = precompute::kGreatestWavenumber / 1000,
      .greatest_wavenumber = precompute::kGreatestWavenumber,
      .goal_db = std::atof(argv[3]),
      .budget_cpu_s = std::atof(argv[4])};
  const auto every = static_cast<size_t>(std::max(1, std::atoi(argv[5])));
  std::printf("%s\n",
              precompute::MeasureBody(modes, settings, every, std::atoi(argv[6])).dump().c_str());
  return EXIT_SUCCESS;
}
