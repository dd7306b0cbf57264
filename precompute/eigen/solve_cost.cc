// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/eigen/solve_cost.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

#include "absl/strings/str_format.h"
#include "precompute/sparse/block_kernels.h"
#include "precompute/sparse/multifrontal_cholesky.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

constexpr size_t kDouble = sizeof(double);
constexpr size_t kFloat = sizeof(float);

/// Approximate number of entries of an update matrix that occupy memory: its lower triangle, and
/// half a page above it in each column.
size_t UpdateNumbers(const FrontalStructure& fronts, int s) {
  constexpr size_t kHalfPage = 512;
  const auto n = static_cast<size_t>(fronts.update_count(s));
  return n * (n + 1) / 2 + n * std::min(n / 2, kHalfPage);
}

/// Number of entries in memory during a factorization, beside the factor: a stack for each thread,
/// or the update matrices that wait for the fronts above, and the panel of one front.
size_t FrontNumbers(const FrontalStructure& fronts, int thread_count) {
  size_t waiting = 0;
  size_t stack = 0;
  for (const Subtree& subtree : fronts.subtrees) {
    stack = std::max(stack, subtree.stack_size);
    waiting += UpdateNumbers(fronts, subtree.end - 1);
  }
  size_t most = waiting + static_cast<size_t>(thread_count) * stack;
  size_t panel = 0;
  for (int s = 0; s < fronts.supernode_count(); ++s) {
    panel = std::max(
        panel, static_cast<size_t>(fronts.height(s)) * static_cast<size_t>(fronts.pivot_count(s)));
  }
  for (const int s : fronts.top) {
    waiting += UpdateNumbers(fronts, s);
    most = std::max(most, waiting);
    for (const int child : fronts.children(s)) waiting -= UpdateNumbers(fronts, child);
  }
  return most + panel;
}

size_t MatrixBytes(const NodeMatrix& A) {
  const size_t entries = A.row.size();
  // Memory of the matrices as assembled (nine numbers with their rows, and three masses) and as
  // NodeMatrix.
  return entries * (9 + 3) * (kDouble + sizeof(int32_t)) +
         entries * (10 * kDouble + sizeof(int32_t));
}

/// Number of blocks of vectors, counted in float, that the iteration needs beside its basis and the
/// refinement beside the modes, in total and for each thread.
constexpr size_t kIterationBlocks = 8;
constexpr size_t kRefinementBlocks = 4;
constexpr size_t kRefinementBlocksOfThread = 2;

/// Rigid-body modes, their momenta, and the modes in elimination order.
constexpr size_t kRigidVectors = 18;

/// Speeds measured on two tubes and two bunnies, linear and quadratic, accurate to a third:
/// operations per second of factorizations in double and in float and of products with the basis,
/// and bytes of the factor per second in solves with sixteen right-hand sides.
constexpr double kDoubleRate = 40e9;
constexpr double kFloatRate = 70e9;
constexpr double kOrthogonalRate = 45e9;
constexpr double kSolveRate = 9e9;
/// Number of solves in a step of the iteration, and in refining a block of modes, where two blocks
/// share a pass.
constexpr double kSolvesOfStep = 1.3;
constexpr double kSolvesOfRefinement = 1.2;
/// Seconds of all dense eigenproblems of the projected matrix, divided by the cube of the final
/// basis size. Measured on a beam of 15,600 unknowns and 3,157 modes.
constexpr double kRitzSeconds = 2.5e-10;
/// Further seconds for each mode and unknown: for refining and verifying, and for couplings and
/// error estimates.
constexpr double kRefineSeconds = 30e-9;
constexpr double kVerifySeconds = 12e-9;
constexpr double kModelSeconds = 100e-9;

}  // namespace

double PredictBasisSize(int mode_count) { return 2.6 * mode_count + 120; }

SolveCost PredictSolveCost(const OrderedSystem& ordered, int mode_count, int thread_count) {
  const FrontalStructure& fronts = ordered.fronts;
  const size_t unknowns = 3 * fronts.order.size();
  const auto modes = static_cast<size_t>(mode_count + kBlockWidth);
  const size_t front_numbers = FrontNumbers(fronts, thread_count);
  const size_t factor = FactorNumbers(fronts) * kFloat;
  const auto basis_size = static_cast<size_t>(PredictBasisSize(mode_count));
  const size_t basis = basis_size * unknowns * kFloat;
  const size_t rough = modes * unknowns * kFloat;
  const size_t shapes = modes * unknowns * kDouble;
  const size_t mass_times = ordered.matrix.mass_is_identity ? 0 : shapes;
  const size_t block = kBlockWidth * unknowns * kFloat;
  const size_t refinement =
      kRefinementBlocks + kRefinementBlocksOfThread * static_cast<size_t>(thread_count);
  SolveCost cost;
  cost.matrix_bytes = MatrixBytes(ordered.matrix);
  cost.peak_bytes = cost.matrix_bytes + kRigidVectors * unknowns * kDouble +
                    std::max({front_numbers * kDouble, factor + front_numbers * kFloat,
                              factor + basis + std::max(rough, kIterationBlocks * block),
                              factor + 2 * shapes + mass_times + refinement * block});
  const auto n = static_cast<double>(unknowns);
  const auto m = static_cast<double>(basis_size);
  const auto p = static_cast<double>(modes);
  const double solves = (kSolvesOfStep * m + kSolvesOfRefinement * p) / kBlockWidth;
  cost.count_s = fronts.factor_flops / kDoubleRate;
  cost.factor_s = fronts.factor_flops / kFloatRate;
  cost.solve_s = solves * 2 * static_cast<double>(factor) / kSolveRate +
                 n * (m * m + m * p) / kOrthogonalRate + 3 * n * p * p / kDoubleRate +
                 n * p * kRefineSeconds + kRitzSeconds * m * m * m;
  cost.verify_s = n * p * p / kDoubleRate + n * p * kVerifySeconds;
  cost.model_s = n * p * kModelSeconds;
  return cost;
}

absl::Status CheckMemory(const SolveCost& cost) {
  const size_t needed = cost.peak_bytes - cost.matrix_bytes;
  std::ifstream file("/proc/meminfo");
  std::string name;
  std::string unit;
  for (size_t kib = 0; file >> name >> kib; std::getline(file, unit)) {
    const size_t available = kib * 1024;
    if (name != "MemAvailable:" || needed <= available) continue;
    constexpr double kGib = 1 << 30;
    absl::Status status = Refusal(
        absl::StatusCode::kResourceExhausted, "MEMORY_TOO_SMALL",
        absl::StrFormat("the decomposition needs %.1f GiB more memory, of which %.1f GiB are "
                        "available; ask for fewer nodes, or free memory",
                        static_cast<double>(needed) / kGib, static_cast<double>(available) / kGib));
    AddFigure(status, "needed_bytes", absl::StrFormat("%d", needed));
    AddFigure(status, "available_bytes", absl::StrFormat("%d", available));
    return status;
  }
  return absl::OkStatus();
}

}  // namespace carillon::precompute
