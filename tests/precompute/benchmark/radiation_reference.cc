// SPDX-License-Identifier: AGPL-3.0-or-later
//
// radiation_reference MODEL SPEED_RATIO ACCURACY_DB BUDGET_S EVERY GREATEST_VERTEX_COUNT
//
// Computes how the modes of a stored modal model radiate, in one thread, then every EVERY-th of
// them anew on a surface with edges half as long, and one of them by an assembled matrix that is
// factorized. Prints one JSON object. Modes whose finer surface would have more vertices than
// GREATEST_VERTEX_COUNT are not computed anew.
#include <Eigen/Dense>
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
#include "precompute/radiation/solve_time.h"
#include "precompute/radiation/surface_levels.h"
#include "precompute/radiation/transfer.h"
#include "tests/precompute/radiation/dense_equation.h"

namespace carillon::precompute {
namespace {

/// The greatest wavenumber of sounds that are heard: 20 kHz.
const double kGreatestWavenumber = 2 * std::numbers::pi * 20000 / Air().sound_speed_m_per_s;
constexpr double kReferenceTolerance = 3e-3;
/// A matrix of more rows would take more than 1 GB beside its factors.
constexpr int kMostDenseRows = 4000;

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

  /// CPU seconds of one mode by sweeps, and by the same equation assembled and factorized.
  nlohmann::json BesideDense(size_t number) {
    const ModeRadiation& mode = transfer_.modes[number];
    const RemeshedSurface& level = ValueOrExit(levels_.At(levels_.LevelOf(mode.edge_m)))->level;
    const SphereGrid grid(PatternOrder(mode.wavenumber, body_.radius_m));
    double begun_s = CpuSeconds();
    const ModeField field =
        SolveRadiation(ProblemOf(number, level), level, body_, grid, workers_).front();
    const double sweeps_s = CpuSeconds() - begun_s;
    begun_s = CpuSeconds();
    const Eigen::MatrixXcf matrix =
        AssembleDense(level.surface, level.near, mode.wavenumber, body_.radius_m)
            .cast<ComplexFloat>();
    const double assembly_s = CpuSeconds() - begun_s;
    begun_s = CpuSeconds();
    const Eigen::PartialPivLU<Eigen::MatrixXcf> factors(matrix);
    return {{"vertices", level.surface.vertex_count()},
            {"iterations", field.iterations},
            {"sweeps_s", sweeps_s},
            {"assembly_s", assembly_s},
            {"factors_s", CpuSeconds() - begun_s}};
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
  nlohmann::json report = {{"cpu_s", transfer.cpu_s}, {"checked", nlohmann::json::array()}};
  size_t wanted = 0, computed = 0, too_large = 0, dense = modes.mode_count();
  for (size_t m = 0; m < modes.mode_count(); ++m) {
    const ModeRadiation& mode = transfer.modes[m];
    if (mode.in_band) ++wanted;
    if (!mode.computed) continue;
    // The middle one of those that fit.
    if (mode.vertex_count <= kMostDenseRows && 2 * m <= modes.mode_count()) dense = m;
    if (computed++ % every != 0) continue;
    nlohmann::json checked = reference.Check(m, most_vertices);
    if (checked.is_null()) {
      ++too_large;
    } else {
      report["checked"].push_back(std::move(checked));
    }
  }
  report.update({{"wanted", wanted}, {"computed", computed}, {"too_large", too_large}});
  if (dense < modes.mode_count()) report["dense"] = reference.BesideDense(dense);
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
