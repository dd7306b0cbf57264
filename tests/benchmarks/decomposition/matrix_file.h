// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/benchmarks/stopwatch.h"

namespace carillon {

/// What the programs of the decomposition benchmark hand each other: raw arrays in little-endian
/// order, which NumPy reads with fromfile.

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
inline void WriteSparse(const std::string& path, const Eigen::SparseMatrix<double>& lower) {
  WriteArray(path + ".start", lower.outerIndexPtr(), static_cast<size_t>(lower.cols()) + 1);
  WriteArray(path + ".row", lower.innerIndexPtr(), static_cast<size_t>(lower.nonZeros()));
  WriteArray(path + ".value", lower.valuePtr(), static_cast<size_t>(lower.nonZeros()));
}

inline Eigen::SparseMatrix<double> ReadSparse(const std::string& path) {
  const auto start = ReadArray<int32_t>(path + ".start");
  const auto row = ReadArray<int32_t>(path + ".row");
  const auto value = ReadArray<double>(path + ".value");
  const auto size = static_cast<Eigen::Index>(start.size()) - 1;
  return Eigen::Map<const Eigen::SparseMatrix<double>>(
      size, size, static_cast<Eigen::Index>(value.size()), start.data(), row.data(), value.data());
}

/// Writes eigenvalues and shapes (column-major) into `folder` and prints the times.
inline void Report(const Stopwatch& watch, const std::string& folder,
                   const Eigen::VectorXd& eigenvalues, const Eigen::MatrixXd& shapes) {
  const double cpu_seconds = watch.CpuSeconds();
  const double seconds = watch.Seconds();
  WriteArray(folder + "/eigenvalues", eigenvalues.data(), static_cast<size_t>(eigenvalues.size()));
  WriteArray(folder + "/shapes", shapes.data(), static_cast<size_t>(shapes.size()));
  std::printf("{\"cpu_seconds\": %.3f, \"seconds\": %.3f}\n", cpu_seconds, seconds);
}

}  // namespace carillon
