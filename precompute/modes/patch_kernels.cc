// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/patch_kernels.h"

#include "precompute/sparse/block_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "precompute/modes/patch_kernels.cc"
// foreach_target.h includes this file once for each target, and must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "precompute/sparse/block_lanes-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace carillon::precompute::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using D = Lanes<double>;
using V = hn::Vec<D>;

/// The parts of as many modes as a vector has lanes.
HWY_INLINE V PartOf(const Patch& patch, const std::array<double, 9>& A, const ShapeRows& rows,
                    int64_t mode) {
  const D d;
  V elastic[3] = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  V inertial[3] = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  for (size_t n = 0; n < patch.nodes.size(); ++n) {
    const PatchBlock& at = patch.blocks[n];
    const double* const from = rows.shapes + 3 * int64_t{patch.nodes[n]} * rows.mode_count + mode;
    const V mass = hn::Set(d, at.mass);
    for (size_t x = 0; x < 3; ++x) {
      const V u = hn::LoadU(d, from + static_cast<int64_t>(x) * rows.mode_count);
      inertial[x] = hn::MulAdd(mass, u, inertial[x]);
      for (size_t y = 0; y < 3; ++y) {
        elastic[y] = hn::MulAdd(hn::Set(d, at.stiffness[3 * y + x]), u, elastic[y]);
      }
    }
  }
  const V eigenvalue = hn::LoadU(d, rows.eigenvalues + mode);
  V r[3];
  for (size_t x = 0; x < 3; ++x) r[x] = hn::NegMulAdd(eigenvalue, inertial[x], elastic[x]);
  V part = hn::Zero(d);
  for (size_t x = 0; x < 3; ++x) {
    V sum = hn::Mul(hn::Set(d, A[3 * x]), r[0]);
    sum = hn::MulAdd(hn::Set(d, A[3 * x + 1]), r[1], sum);
    sum = hn::MulAdd(hn::Set(d, A[3 * x + 2]), r[2], sum);
    part = hn::MulAdd(r[x], sum, part);
  }
  return part;
}

void PatchParts(const Patch& patch, const std::array<double, 9>& A, const ShapeRows& rows,
                double* sums, float* parts) {
  const D d;
  const hn::Rebind<float, D> narrow;
  for (int64_t mode = 0; mode < rows.mode_count; mode += LaneCount<double>()) {
    const V part = PartOf(patch, A, rows, mode);
    hn::StoreU(hn::Add(hn::LoadU(d, sums + mode), part), d, sums + mode);
    hn::StoreU(hn::DemoteTo(narrow, part), narrow, parts + mode);
  }
}

void SquaredDivergences(std::span<const int32_t> nodes, const double* gradients, double volume_m3,
                        const ShapeRows& rows, double* sums) {
  const D d;
  const V volume = hn::Set(d, volume_m3);
  for (int64_t mode = 0; mode < rows.mode_count; mode += LaneCount<double>()) {
    V divergence[3] = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    for (size_t n = 0; n < nodes.size(); ++n) {
      const double* const from = rows.shapes + 3 * int64_t{nodes[n]} * rows.mode_count + mode;
      for (size_t x = 0; x < 3; ++x) {
        const V u = hn::LoadU(d, from + static_cast<int64_t>(x) * rows.mode_count);
        divergence[x] = hn::MulAdd(hn::Set(d, gradients[3 * n + x]), u, divergence[x]);
      }
    }
    const V whole = hn::Add(divergence[0], hn::Add(divergence[1], divergence[2]));
    const V sum = hn::LoadU(d, sums + mode);
    hn::StoreU(hn::MulAdd(hn::Mul(volume, whole), whole, sum), d, sums + mode);
  }
}

}  // namespace carillon::precompute::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carillon::precompute {

HWY_EXPORT(PatchParts);
HWY_EXPORT(SquaredDivergences);

void AddPatchParts(const Patch& patch, const std::array<double, 9>& A, const ShapeRows& rows,
                   double* sums, float* parts) {
  HWY_DYNAMIC_DISPATCH(PatchParts)(patch, A, rows, sums, parts);
}

void AddSquaredDivergences(std::span<const int32_t> nodes, const double* gradients,
                           double volume_m3, const ShapeRows& rows, double* sums) {
  HWY_DYNAMIC_DISPATCH(SquaredDivergences)(nodes, gradients, volume_m3, rows, sums);
}

}  // namespace carillon::precompute
#endif
