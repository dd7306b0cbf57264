// SPDX-License-Identifier: AGPL-3.0-or-later
//
// Carillon's part in the decomposition benchmark.
//
//     matrices_benchmark make SURFACE.obj FOLDER linear|quadratic lumped|consistent NODES YOUNG
//     POISSON DENSITY matrices_benchmark solve FOLDER LIMIT_HZ THREADS
//
// `make` meshes a surface, keeping its vertices, and writes the mesh and its matrices; `solve`
// reads the matrices and finds every mode up to a frequency.

#include <Eigen/SparseCore>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <numbers>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "precompute/fem/assembly.h"
#include "precompute/mesh/fill/tetrahedralize.h"
#include "precompute/mesh/read/read_mesh.h"
#include "precompute/modes/deformation_modes.h"
#include "precompute/sparse/openblas.h"
#include "tests/benchmarks/stopwatch.h"

namespace carillon::precompute {
namespace {

// What the programs of the decomposition benchmark hand each other: raw arrays in little-endian
// order, which NumPy reads with fromfile.

template <typename Number>
void WriteArray(const std::string& path, const Number* data, size_t count) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(data),
             static_cast<std::streamsize>(count * sizeof(Number)));
  if (!file.good()) throw std::runtime_error(path + " cannot be written");
}

template <typename Number>
std::vector<Number> ReadArray(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file.good()) throw std::runtime_error(path + " cannot be read");
  std::vector<Number> data(static_cast<size_t>(file.tellg()) / sizeof(Number));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(data.data()),
            static_cast<std::streamsize>(data.size() * sizeof(Number)));
  return data;
}

/// The lower triangle of a symmetric matrix by columns: PATH.start, PATH.row (both int32),
/// PATH.value.
void WriteSparse(const std::string& path, const Eigen::SparseMatrix<double>& lower) {
  WriteArray(path + ".start", lower.outerIndexPtr(), static_cast<size_t>(lower.cols()) + 1);
  WriteArray(path + ".row", lower.innerIndexPtr(), static_cast<size_t>(lower.nonZeros()));
  WriteArray(path + ".value", lower.valuePtr(), static_cast<size_t>(lower.nonZeros()));
}

Eigen::SparseMatrix<double> ReadSparse(const std::string& path) {
  const auto start = ReadArray<int32_t>(path + ".start");
  const auto row = ReadArray<int32_t>(path + ".row");
  const auto value = ReadArray<double>(path + ".value");
  const auto size = static_cast<Eigen::Index>(start.size()) - 1;
  return Eigen::Map<const Eigen::SparseMatrix<double>>(
      size, size, static_cast<Eigen::Index>(value.size()), start.data(), row.data(), value.data());
}

/// Writes eigenvalues and shapes (column-major) into `folder` and prints the times.
void Report(const Stopwatch& watch, const std::string& folder, const Eigen::VectorXd& eigenvalues,
            const Eigen::MatrixXd& shapes) {
  const double cpu_seconds = watch.CpuSeconds();
  const double seconds = watch.Seconds();
  WriteArray(folder + "/eigenvalues", eigenvalues.data(), static_cast<size_t>(eigenvalues.size()));
  WriteArray(folder + "/shapes", shapes.data(), static_cast<size_t>(shapes.size()));
  std::printf("{\"cpu_seconds\": %.3f, \"seconds\": %.3f}\n", cpu_seconds, seconds);
}

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
