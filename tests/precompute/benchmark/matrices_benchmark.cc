// SPDX-License-Identifier: AGPL-3.0-or-later
//
// Carillon's part in the decomposition benchmark.
//
//     matrices_benchmark make SURFACE.obj FOLDER linear|quadratic lumped|consistent NODES YOUNG
//     POISSON DENSITY matrices_benchmark solve FOLDER LIMIT_HZ THREADS
//
// `make` meshes a surface, keeping its vertices, and writes the mesh and its matrices; `solve`
// reads the matrices and finds every mode up to a frequency.

#include <array>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <numbers>
#include <string>
#include <string_view>

#include "absl/strings/str_format.h"
#include "precompute/fem/assembly.h"
#include "precompute/mesh/fill/tetrahedralize.h"
#include "precompute/mesh/read/read_mesh.h"
#include "precompute/modes/deformation_modes.h"
#include "precompute/sparse/openblas.h"
#include "tests/benchmarks/decomposition/matrix_file.h"

namespace carillon::precompute {
namespace {

template <typename T>
T ValueOrThrow(absl::StatusOr<T> value) {
  if (!value.ok()) throw std::runtime_error(value.status().ToString());
  return *std::move(value);
}

int Make(char** argv) {
  const std::string folder = argv[1];
  const bool linear = std::string_view(argv[2]) == "linear";
  const MassSharing sharing =
      std::string_view(argv[3]) == "lumped" ? MassSharing::kLumped : MassSharing::kConsistent;
  const Mesh surface = ValueOrThrow(ReadMesh(argv[0], "obj", 1)).mesh;
  const TetMesh mesh = ValueOrThrow(
      Tetrahedralize(std::get<SurfaceMesh>(surface), {.keep_surface = true,
                                                      .target_node_count = std::atoi(argv[4]),
                                                      .nodes_per_element = linear ? 4 : 10}));
  const SystemMatrices system =
      Assemble(mesh, {.young_pa = std::atof(argv[5]), .poisson_ratio = std::atof(argv[6])},
               std::atof(argv[7]), sharing);
  WriteSparse(folder + "/K", system.K);
  WriteSparse(folder + "/M", system.M);
  WriteArray(folder + "/nodes", mesh.nodes.data(), mesh.nodes.size());
  WriteArray(folder + "/elements", mesh.elements.data(), mesh.elements.size());
  return EXIT_SUCCESS;
}

/// Attributes the processor time between two reports of progress to the stage of the first.
class StageTimes {
 public:
  explicit StageTimes(const Stopwatch& watch) : watch_(watch) {}

  void Enter(SolveStage stage) {
    const double now = watch_.CpuSeconds();
    seconds_[at_] += now - since_;
    since_ = now;
    if (stage == SolveStage::kFactor) at_ = kFactor;
    if (stage == SolveStage::kSolve) at_ = kSolve;
    // Counting is the first part of the stage kVerify.
    if (stage == SolveStage::kVerify && at_ != kCount) at_ = kVerify;
  }

  /// Returns the seconds and the work as members of a JSON object.
  std::string Members(const SolveWork& work) {
    Enter(SolveStage::kVerify);
    return absl::StrFormat(
        ", \"count_s\": %.4f, \"factor_s\": %.4f, \"solve_s\": %.4f, \"verify_s\": %.4f, "
        "\"factor_multiply_adds\": %.6g, \"factor_entries\": %.6g, \"unknowns\": %.6g, "
        "\"basis_size\": %d",
        seconds_[kCount], seconds_[kFactor], seconds_[kSolve], seconds_[kVerify],
        work.factor_multiply_adds, work.factor_entries, work.unknowns, work.basis_size);
  }

 private:
  /// kCount has the ordering, too.
  enum Stage { kCount, kFactor, kSolve, kVerify };

  const Stopwatch& watch_;
  std::array<double, 4> seconds_{};
  double since_ = 0;
  Stage at_ = kCount;
};

int Solve(char** argv) {
  const std::string folder = argv[0];
  const double omega = 2 * std::numbers::pi * std::atof(argv[1]);
  SetThreadCount(std::atoi(argv[2]));
  const SystemMatrices system{.K = ReadSparse(folder + "/K"), .M = ReadSparse(folder + "/M")};
  const auto nodes = ReadArray<Point>(folder + "/nodes");
  const Stopwatch watch;
  StageTimes stages(watch);
  const DeformationModes solution = ValueOrThrow(SolveDeformationModes(
      system, nodes, omega * omega, [&](SolveStage stage, double) { stages.Enter(stage); }));
  Report(watch, folder, solution.modes.eigenvalues, solution.modes.shapes,
         stages.Members(solution.work));
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace carillon::precompute

int main(int argc, char** argv) try {
  const std::string_view verb = argc > 1 ? argv[1] : "";
  if (verb == "make" && argc == 10) return carillon::precompute::Make(argv + 2);
  if (verb == "solve" && argc == 5) return carillon::precompute::Solve(argv + 2);
  std::fputs(
      "usage: matrices_benchmark make SURFACE.obj FOLDER linear|quadratic lumped|consistent "
      "NODES YOUNG POISSON DENSITY\n       matrices_benchmark solve FOLDER LIMIT_HZ THREADS\n",
      stderr);
  return EXIT_FAILURE;
} catch (const std::exception& error) {
  std::fprintf(stderr, "matrices_benchmark: %s\n", error.what());
  return EXIT_FAILURE;
}
