// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/sparse/tile_kernels.h"

#include <hwy/cache_control.h>

#include "precompute/sparse/block_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "precompute/sparse/tile_kernels.cc"
// foreach_target.h includes this file once for each target, and must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "precompute/sparse/block_lanes-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace carillon::precompute::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Distance of the software prefetch, in numbers: hardware prefetchers stop at the end of each
/// page, and a factor fills many pages.
constexpr int kAhead = 768;

template <typename Real, int kWidth>
HWY_INLINE void Forward(const Real* HWY_RESTRICT tile, int column_count, const Real* HWY_RESTRICT y,
                        Real* const x[2]) {
  const Lanes<Real> d;
  using V = hn::Vec<Lanes<Real>>;
  constexpr int kLanes = LaneCount<Real>();
  constexpr int kVectors = Chunk<Real, kWidth>() / kLanes;
  // Sums of one vector for each row form six dependency chains, too few for two multiply-add units.
  // Twelve chains are used instead.
  constexpr int kSets = kVectors == 1 ? 2 : 1;
  for (int c = 0; c < kWidth; c += Chunk<Real, kWidth>()) {
    V sum[kSets][kTileRows][kVectors];
    for (auto& set : sum) {
      for (auto& row : set) {
        for (V& v : row) v = hn::Zero(d);
      }
    }
    const Real* HWY_RESTRICT l = tile;
    const Real* HWY_RESTRICT yi = y + c;
    const auto add_column = [&](auto& set) HWY_ATTR {
      V yv[kVectors];
      for (int v = 0; v < kVectors; ++v) yv[v] = hn::LoadU(d, yi + v * kLanes);
      for (int r = 0; r < kTileRows; ++r) {
        const V lr = hn::Set(d, l[r]);
        for (int v = 0; v < kVectors; ++v) set[r][v] = hn::MulAdd(lr, yv[v], set[r][v]);
      }
      l += kTileRows;
      yi += kWidth;
    };
    int i = 0;
    for (; i + 2 <= column_count; i += 2) {
      hwy::Prefetch(l + kAhead);
      add_column(sum[0]);
      add_column(sum[kSets - 1]);
    }
    if (i < column_count) add_column(sum[0]);
    for (int r = 0; r < kTileRows; ++r) {
      Real* out = x[r / 3] + r % 3 * kWidth + c;
      for (int v = 0; v < kVectors; ++v) {
        if (kSets == 2) sum[0][r][v] = hn::Add(sum[0][r][v], sum[kSets - 1][r][v]);
        hn::StoreU(hn::Sub(hn::LoadU(d, out + v * kLanes), sum[0][r][v]), d, out + v * kLanes);
      }
    }
  }
}

template <typename Real, int kWidth>
HWY_INLINE void Backward(const Real* HWY_RESTRICT tile, int column_count, Real* HWY_RESTRICT y,
                         const Real* const x[2]) {
  const Lanes<Real> d;
  using V = hn::Vec<Lanes<Real>>;
  constexpr int kLanes = LaneCount<Real>();
  constexpr int kVectors = Chunk<Real, kWidth>() / kLanes;
  for (int c = 0; c < kWidth; c += Chunk<Real, kWidth>()) {
    V xv[kTileRows][kVectors];
    for (int r = 0; r < kTileRows; ++r) {
      for (int v = 0; v < kVectors; ++v) {
        xv[r][v] = hn::LoadU(d, x[r / 3] + r % 3 * kWidth + c + v * kLanes);
      }
    }
    const Real* HWY_RESTRICT l = tile;
    Real* HWY_RESTRICT yi = y + c;
    const auto subtract_column = [&]() HWY_ATTR {
      for (int v = 0; v < kVectors; ++v) {
        // Two chains of three, because each multiply-add waits for the one before.
        V even = hn::LoadU(d, yi + v * kLanes);
        V odd = hn::Mul(hn::Set(d, l[1]), xv[1][v]);
        even = hn::NegMulAdd(hn::Set(d, l[0]), xv[0][v], even);
        odd = hn::MulAdd(hn::Set(d, l[3]), xv[3][v], odd);
        even = hn::NegMulAdd(hn::Set(d, l[2]), xv[2][v], even);
        odd = hn::MulAdd(hn::Set(d, l[5]), xv[5][v], odd);
        even = hn::NegMulAdd(hn::Set(d, l[4]), xv[4][v], even);
        hn::StoreU(hn::Sub(even, odd), d, yi + v * kLanes);
      }
      l += kTileRows;
      yi += kWidth;
    };
    int i = 0;
    for (; i + 2 <= column_count; i += 2) {
      hwy::Prefetch(l + kAhead);
      subtract_column();
      subtract_column();
    }
    if (i < column_count) subtract_column();
  }
}

/// Six rows of x by the triangle of a diagonal tile, its diagonal inverted.
template <typename Real, int kWidth, bool kTransposed>
HWY_INLINE void SolveTriangle(const Real* HWY_RESTRICT tile, Real* HWY_RESTRICT x) {
  const Lanes<Real> d;
  using V = hn::Vec<Lanes<Real>>;
  constexpr int kLanes = LaneCount<Real>();
  for (int k = 0; k < kWidth; k += kLanes) {
    V row[kTileRows];
    for (int r = 0; r < kTileRows; ++r) row[r] = hn::LoadU(d, x + r * kWidth + k);
    for (int step = 0; step < kTileRows; ++step) {
      const int c = kTransposed ? kTileRows - 1 - step : step;
      const Real* column = tile + c * kTileRows;
      if (kTransposed) {
        for (int r = c + 1; r < kTileRows; ++r) {
          row[c] = hn::NegMulAdd(hn::Set(d, column[r]), row[r], row[c]);
        }
      }
      row[c] = hn::Mul(row[c], hn::Set(d, column[c]));
      if (!kTransposed) {
        for (int r = c + 1; r < kTileRows; ++r) {
          row[r] = hn::NegMulAdd(hn::Set(d, column[r]), row[c], row[r]);
        }
      }
    }
    for (int r = 0; r < kTileRows; ++r) hn::StoreU(row[r], d, x + r * kWidth + k);
  }
}

void ForwardDouble(const double* tile, int n, const double* y, double* const x[2]) {
  Forward<double, kBlockWidth>(tile, n, y, x);
}
void BackwardDouble(const double* tile, int n, double* y, const double* const x[2]) {
  Backward<double, kBlockWidth>(tile, n, y, x);
}
void TriangleDouble(const double* tile, double* x) {
  SolveTriangle<double, kBlockWidth, false>(tile, x);
}
void TransposedDouble(const double* tile, double* x) {
  SolveTriangle<double, kBlockWidth, true>(tile, x);
}
void ForwardFloat(const float* tile, int n, const float* y, float* const x[2]) {
  Forward<float, kBlockWidth>(tile, n, y, x);
}
void BackwardFloat(const float* tile, int n, float* y, const float* const x[2]) {
  Backward<float, kBlockWidth>(tile, n, y, x);
}
void TriangleFloat(const float* tile, float* x) {
  SolveTriangle<float, kBlockWidth, false>(tile, x);
}
void TransposedFloat(const float* tile, float* x) {
  SolveTriangle<float, kBlockWidth, true>(tile, x);
}
void ForwardFloatWide(const float* tile, int n, const float* y, float* const x[2]) {
  Forward<float, kWideBlock>(tile, n, y, x);
}
void BackwardFloatWide(const float* tile, int n, float* y, const float* const x[2]) {
  Backward<float, kWideBlock>(tile, n, y, x);
}
void TriangleFloatWide(const float* tile, float* x) {
  SolveTriangle<float, kWideBlock, false>(tile, x);
}
void TransposedFloatWide(const float* tile, float* x) {
  SolveTriangle<float, kWideBlock, true>(tile, x);
}

}  // namespace carillon::precompute::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carillon::precompute {

HWY_EXPORT(ForwardDouble);
HWY_EXPORT(BackwardDouble);
HWY_EXPORT(TriangleDouble);
HWY_EXPORT(TransposedDouble);
HWY_EXPORT(ForwardFloat);
HWY_EXPORT(BackwardFloat);
HWY_EXPORT(TriangleFloat);
HWY_EXPORT(TransposedFloat);
HWY_EXPORT(ForwardFloatWide);
HWY_EXPORT(BackwardFloatWide);
HWY_EXPORT(TriangleFloatWide);
HWY_EXPORT(TransposedFloatWide);

template <>
void TileForward<double, kBlockWidth>(const double* tile, int column_count, const double* y,
                                      double* const x[2]) {
  HWY_DYNAMIC_DISPATCH(ForwardDouble)(tile, column_count, y, x);
}
template <>
void TileBackward<double, kBlockWidth>(const double* tile, int column_count, double* y,
                                       const double* const x[2]) {
  HWY_DYNAMIC_DISPATCH(BackwardDouble)(tile, column_count, y, x);
}
template <>
void TileSolve<double, kBlockWidth>(const double* tile, double* x) {
  HWY_DYNAMIC_DISPATCH(TriangleDouble)(tile, x);
}
template <>
void TileSolveTransposed<double, kBlockWidth>(const double* tile, double* x) {
  HWY_DYNAMIC_DISPATCH(TransposedDouble)(tile, x);
}

template <>
void TileForward<float, kBlockWidth>(const float* tile, int column_count, const float* y,
                                     float* const x[2]) {
  HWY_DYNAMIC_DISPATCH(ForwardFloat)(tile, column_count, y, x);
}
template <>
void TileBackward<float, kBlockWidth>(const float* tile, int column_count, float* y,
                                      const float* const x[2]) {
  HWY_DYNAMIC_DISPATCH(BackwardFloat)(tile, column_count, y, x);
}
template <>
void TileSolve<float, kBlockWidth>(const float* tile, float* x) {
  HWY_DYNAMIC_DISPATCH(TriangleFloat)(tile, x);
}
template <>
void TileSolveTransposed<float, kBlockWidth>(const float* tile, float* x) {
  HWY_DYNAMIC_DISPATCH(TransposedFloat)(tile, x);
}

template <>
void TileForward<float, kWideBlock>(const float* tile, int column_count, const float* y,
                                    float* const x[2]) {
  HWY_DYNAMIC_DISPATCH(ForwardFloatWide)(tile, column_count, y, x);
}
template <>
void TileBackward<float, kWideBlock>(const float* tile, int column_count, float* y,
                                     const float* const x[2]) {
  HWY_DYNAMIC_DISPATCH(BackwardFloatWide)(tile, column_count, y, x);
}
template <>
void TileSolve<float, kWideBlock>(const float* tile, float* x) {
  HWY_DYNAMIC_DISPATCH(TriangleFloatWide)(tile, x);
}
template <>
void TileSolveTransposed<float, kWideBlock>(const float* tile, float* x) {
  HWY_DYNAMIC_DISPATCH(TransposedFloatWide)(tile, x);
}

}  // namespace carillon::precompute
#endif
