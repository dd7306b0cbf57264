// SPDX-License-Identifier: AGPL-3.0-or-later
//
// Carillon's part in the decomposition benchmark.
//
//     matrices_benchmark make SURFACE.obj FOLDER linear|quadratic lumped|consistent NODES YOUNG
//     POISSON DENSITY matrices_benchmark solve FOLDER LIMIT_HZ THREADS
//
// `make` meshes a surface, keeping its vertices, and writes the mesh and its matrices; `solve`
// reads the matrices and finds every mode up to a frequency.

#include <cmath>
#include <cstdlib>
#include <exception>
#include <numbers>
#include <string>
#include <string_view>

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

int Solve(char** argv) {
  const std::string folder = argv[0];
  const double omega = 2 * std::numbers::pi * std::atof(argv[1]);
  SetThreadCount(std::atoi(argv[2]));
  const SystemMatrices system{.K = ReadSparse(folder + "/K"), .M = ReadSparse(folder + "/M")};
  const auto nodes = ReadArray<Point>(folder + "/nodes");
  const Stopwatch watch;
  const DeformationModes solution =
      ValueOrThrow(SolveDeformationModes(system, nodes, omega * omega, [](SolveStage, double) {}));
  Report(watch, folder, solution.modes.eigenvalues, solution.modes.shapes);
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
