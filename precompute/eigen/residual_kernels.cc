// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/eigen/residual_kernels.h"

#include <type_traits>

#include "precompute/sparse/block_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "precompute/eigen/residual_kernels.cc"
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
constexpr int kLanes = LaneCount<double>();
constexpr int kVectors = kBlockWidth / kLanes;

struct Row {
  V v[kVectors];
};

HWY_INLINE Row Load(const double* from) {
  Row row;
  for (int i = 0; i < kVectors; ++i) row.v[i] = hn::LoadU(D(), from + i * kLanes);
  return row;
}

HWY_INLINE void Store(const Row& row, double* to) {
  for (int i = 0; i < kVectors; ++i) hn::StoreU(row.v[i], D(), to + i * kLanes);
}

void RayleighSums(const double* x, const double* elastic, const double* inertial, int64_t rows,
                  double* energy, double* mass) {
  Row e = Load(energy);
  Row m = Load(mass);
  for (int64_t r = 0; r < rows; ++r) {
    const Row xr = Load(x + r * kBlockWidth);
    const Row kx = Load(elastic + r * kBlockWidth);
    const Row mx = Load(inertial + r * kBlockWidth);
    for (int i = 0; i < kVectors; ++i) {
      e.v[i] = hn::MulAdd(xr.v[i], kx.v[i], e.v[i]);
      m.v[i] = hn::MulAdd(xr.v[i], mx.v[i], m.v[i]);
    }
  }
  Store(e, energy);
  Store(m, mass);
}

void ResidualSums(const double* quotient, const double* root_mass, const double* elastic,
                  const double* inertial, int64_t nodes, double* residual, double* scale) {
  const Row q = Load(quotient);
  Row left = Load(residual);
  Row whole = Load(scale);
  for (int64_t r = 0; r < 3 * nodes; ++r) {
    const V root = hn::Set(D(), root_mass[r / 3]);
    const Row kx = Load(elastic + r * kBlockWidth);
    const Row mx = Load(inertial + r * kBlockWidth);
    for (int i = 0; i < kVectors; ++i) {
      const V off = hn::Mul(root, hn::NegMulAdd(q.v[i], mx.v[i], kx.v[i]));
      const V load = hn::Mul(root, mx.v[i]);
      left.v[i] = hn::MulAdd(off, off, left.v[i]);
      whole.v[i] = hn::MulAdd(load, load, whole.v[i]);
    }
  }
  Store(left, residual);
  Store(whole, scale);
}

template <typename Real>
HWY_INLINE void WriteResidual(const double* quotient, const double* elastic, const double* inertial,
                              int64_t rows, int64_t stride, Real* HWY_RESTRICT out) {
  const hn::Rebind<Real, D> narrow;
  const Row q = Load(quotient);
  for (int64_t r = 0; r < rows; ++r) {
    const Row kx = Load(elastic + r * kBlockWidth);
    const Row mx = Load(inertial + r * kBlockWidth);
    for (int i = 0; i < kVectors; ++i) {
      const V off = hn::NegMulAdd(q.v[i], mx.v[i], kx.v[i]);
      Real* to = out + r * stride + i * kLanes;
      if constexpr (std::is_same_v<Real, float>) {
        hn::StoreU(hn::DemoteTo(narrow, off), narrow, to);
      } else {
        hn::StoreU(off, narrow, to);
      }
    }
  }
}

template <typename Real>
HWY_INLINE void Change(const Real* HWY_RESTRICT change, int64_t stride, int64_t rows,
                       double* HWY_RESTRICT x) {
  const hn::Rebind<Real, D> narrow;
  for (int64_t r = 0; r < rows; ++r) {
    for (int i = 0; i < kVectors; ++i) {
      double* to = x + r * kBlockWidth + i * kLanes;
      const auto from = hn::LoadU(narrow, change + r * stride + i * kLanes);
      if constexpr (std::is_same_v<Real, float>) {
        hn::StoreU(hn::Sub(hn::LoadU(D(), to), hn::PromoteTo(D(), from)), D(), to);
      } else {
        hn::StoreU(hn::Sub(hn::LoadU(D(), to), from), D(), to);
      }
    }
  }
}

template <typename Real>
HWY_INLINE void SolveResidual(const Real* HWY_RESTRICT right, const double* HWY_RESTRICT elastic,
                              const Real* HWY_RESTRICT inertial, double shift, int64_t count,
                              Real* HWY_RESTRICT out) {
  const hn::Rebind<Real, D> narrow;
  const V s = hn::Set(D(), shift);
  for (int64_t i = 0; i < count; i += kLanes) {
    const auto b = hn::LoadU(narrow, right + i);
    const auto m = hn::LoadU(narrow, inertial + i);
    const V kx = hn::LoadU(D(), elastic + i);
    if constexpr (std::is_same_v<Real, float>) {
      const V off = hn::NegMulAdd(s, hn::PromoteTo(D(), m), kx);
      hn::StoreU(hn::Sub(b, hn::DemoteTo(narrow, off)), narrow, out + i);
    } else {
      hn::StoreU(hn::Sub(b, hn::NegMulAdd(s, m, kx)), narrow, out + i);
    }
  }
}

void SolveResidualFloat(const float* right, const double* elastic, const float* inertial,
                        double shift, int64_t count, float* out) {
  SolveResidual<float>(right, elastic, inertial, shift, count, out);
}
void SolveResidualDouble(const double* right, const double* elastic, const double* inertial,
                         double shift, int64_t count, double* out) {
  SolveResidual<double>(right, elastic, inertial, shift, count, out);
}
void ResidualFloat(const double* quotient, const double* elastic, const double* inertial,
                   int64_t rows, int64_t stride, float* out) {
  WriteResidual<float>(quotient, elastic, inertial, rows, stride, out);
}
void ResidualDouble(const double* quotient, const double* elastic, const double* inertial,
                    int64_t rows, int64_t stride, double* out) {
  WriteResidual<double>(quotient, elastic, inertial, rows, stride, out);
}
void ChangeFloat(const float* change, int64_t stride, int64_t rows, double* x) {
  Change<float>(change, stride, rows, x);
}
void ChangeDouble(const double* change, int64_t stride, int64_t rows, double* x) {
  Change<double>(change, stride, rows, x);
}

}  // namespace carillon::precompute::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carillon::precompute {

HWY_EXPORT(RayleighSums);
HWY_EXPORT(ResidualSums);
HWY_EXPORT(ResidualFloat);
HWY_EXPORT(ResidualDouble);
HWY_EXPORT(SolveResidualFloat);
HWY_EXPORT(SolveResidualDouble);
HWY_EXPORT(ChangeFloat);
HWY_EXPORT(ChangeDouble);

void AddRayleighSums(const double* x, const double* elastic, const double* inertial, int64_t rows,
                     double* energy, double* mass) {
  HWY_DYNAMIC_DISPATCH(RayleighSums)(x, elastic, inertial, rows, energy, mass);
}
void AddResidualSums(const double* quotient, const double* root_mass, const double* elastic,
                     const double* inertial, int64_t nodes, double* residual, double* scale) {
  HWY_DYNAMIC_DISPATCH(ResidualSums)
  (quotient, root_mass, elastic, inertial, nodes, residual, scale);
}
template <>
void StoreResidual<float>(const double* quotient, const double* elastic, const double* inertial,
                          int64_t rows, int64_t stride, float* out) {
  HWY_DYNAMIC_DISPATCH(ResidualFloat)(quotient, elastic, inertial, rows, stride, out);
}
template <>
void StoreResidual<double>(const double* quotient, const double* elastic, const double* inertial,
                           int64_t rows, int64_t stride, double* out) {
  HWY_DYNAMIC_DISPATCH(ResidualDouble)(quotient, elastic, inertial, rows, stride, out);
}
template <>
void StoreSolveResidual<float>(const float* right, const double* elastic, const float* inertial,
                               double shift, int64_t count, float* out) {
  HWY_DYNAMIC_DISPATCH(SolveResidualFloat)(right, elastic, inertial, shift, count, out);
}
template <>
void StoreSolveResidual<double>(const double* right, const double* elastic, const double* inertial,
                                double shift, int64_t count, double* out) {
  HWY_DYNAMIC_DISPATCH(SolveResidualDouble)(right, elastic, inertial, shift, count, out);
}
template <>
void SubtractChange<float>(const float* change, int64_t stride, int64_t rows, double* x) {
  HWY_DYNAMIC_DISPATCH(ChangeFloat)(change, stride, rows, x);
}
template <>
void SubtractChange<double>(const double* change, int64_t stride, int64_t rows, double* x) {
  HWY_DYNAMIC_DISPATCH(ChangeDouble)(change, stride, rows, x);
}

}  // namespace carillon::precompute
#endif
