// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/sparse/block_kernels.h"

#include <hwy/cache_control.h>

#include <type_traits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "precompute/sparse/block_kernels.cc"
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
/// page.
constexpr int kAhead = 384;

template <typename Real>
HWY_INLINE hn::Vec<Lanes<double>> LoadAsDouble(const Real* from) {
  const Lanes<double> d;
  if constexpr (std::is_same_v<Real, float>) {
    return hn::PromoteTo(d, hn::LoadU(hn::Rebind<float, Lanes<double>>(), from));
  } else {
    return hn::LoadU(d, from);
  }
}

template <typename Real>
HWY_INLINE void MultiplyColumn(const double* HWY_RESTRICT blocks, const int32_t* HWY_RESTRICT rows,
                               int count, int j, const Real* HWY_RESTRICT x,
                               double* HWY_RESTRICT y) {
  const Lanes<double> d;
  using V = hn::Vec<Lanes<double>>;
  const int lanes = static_cast<int>(hn::Lanes(d));
  constexpr int kNode = 3 * kBlockWidth;
  const Real* xj = x + static_cast<size_t>(j) * kNode;
  double* yj = y + static_cast<size_t>(j) * kNode;
  for (int c = 0; c < kBlockWidth; c += lanes) {
    const V x0 = LoadAsDouble(xj + c);
    const V x1 = LoadAsDouble(xj + kBlockWidth + c);
    const V x2 = LoadAsDouble(xj + 2 * kBlockWidth + c);
    V y0 = hn::LoadU(d, yj + c);
    V y1 = hn::LoadU(d, yj + kBlockWidth + c);
    V y2 = hn::LoadU(d, yj + 2 * kBlockWidth + c);
    const auto row = [&](const double* b) {
      return hn::MulAdd(hn::Set(d, b[0]), x0,
                        hn::MulAdd(hn::Set(d, b[1]), x1, hn::Mul(hn::Set(d, b[2]), x2)));
    };
    y0 = hn::Add(y0, row(blocks));
    y1 = hn::Add(y1, row(blocks + 3));
    y2 = hn::Add(y2, row(blocks + 6));
    for (int e = 1; e < count; ++e) {
      const double* b = blocks + static_cast<size_t>(e) * 9;
      hwy::Prefetch(b + kAhead);
      const Real* xi = x + static_cast<size_t>(rows[e]) * kNode + c;
      double* yi = y + static_cast<size_t>(rows[e]) * kNode + c;
      for (int a = 0; a < 3; ++a) {
        double* out = yi + a * kBlockWidth;
        hn::StoreU(hn::Add(hn::LoadU(d, out), row(b + 3 * a)), d, out);
        const V xa = LoadAsDouble(xi + a * kBlockWidth);
        y0 = hn::MulAdd(hn::Set(d, b[3 * a]), xa, y0);
        y1 = hn::MulAdd(hn::Set(d, b[3 * a + 1]), xa, y1);
        y2 = hn::MulAdd(hn::Set(d, b[3 * a + 2]), xa, y2);
      }
    }
    hn::StoreU(y0, d, yj + c);
    hn::StoreU(y1, d, yj + kBlockWidth + c);
    hn::StoreU(y2, d, yj + 2 * kBlockWidth + c);
  }
}

template <typename Real>
HWY_INLINE void MultiplyRow(const Real* HWY_RESTRICT m, const int32_t* HWY_RESTRICT columns,
                            int count, const Real* HWY_RESTRICT x, Real* HWY_RESTRICT y) {
  const Lanes<Real> d;
  using V = hn::Vec<Lanes<Real>>;
  constexpr int kLanes = LaneCount<Real>();
  constexpr int kNode = 3 * kBlockWidth;
  for (int c = 0; c < kNode; c += kLanes) {
    V sum = hn::Zero(d);
    for (int e = 0; e < count; ++e) {
      const Real* xj = x + static_cast<size_t>(columns[e]) * kNode + c;
      sum = hn::MulAdd(hn::Set(d, m[e]), hn::LoadU(d, xj), sum);
    }
    hn::StoreU(sum, d, y + c);
  }
}

/// Rows of a's columns whose products with b are kept in registers at once.
template <typename Real>
constexpr int DotRows() {
  if (HWY_MAX_BYTES < 64) return 4;
  return LaneCount<Real>() == kBlockWidth ? 16 : 8;
}

template <typename Real>
HWY_INLINE void Dot(const Real* HWY_RESTRICT a, const Real* HWY_RESTRICT b, int64_t rows,
                    Real* HWY_RESTRICT product) {
  const Lanes<Real> d;
  using V = hn::Vec<Lanes<Real>>;
  constexpr int kLanes = LaneCount<Real>();
  constexpr int kVectors = Chunk<Real>() / kLanes;
  constexpr int kRows = DotRows<Real>();
  for (int first = 0; first < kBlockWidth; first += kRows) {
    for (int c = 0; c < kBlockWidth; c += Chunk<Real>()) {
      V sum[kRows][kVectors];
      for (auto& row : sum) {
        for (V& v : row) v = hn::Zero(d);
      }
      const Real* HWY_RESTRICT ai = a + first;
      const Real* HWY_RESTRICT bi = b + c;
      for (int64_t i = 0; i < rows; ++i, ai += kBlockWidth, bi += kBlockWidth) {
        hwy::Prefetch(ai + kAhead);
        for (int v = 0; v < kVectors; ++v) {
          const V bv = hn::LoadU(d, bi + v * kLanes);
          for (int r = 0; r < kRows; ++r) sum[r][v] = hn::MulAdd(hn::Set(d, ai[r]), bv, sum[r][v]);
        }
      }
      for (int r = 0; r < kRows; ++r) {
        Real* out = product + (first + r) * kBlockWidth + c;
        for (int v = 0; v < kVectors; ++v) hn::StoreU(sum[r][v], d, out + v * kLanes);
      }
    }
  }
}

template <typename Real>
HWY_INLINE void SubtractTimes(const Real* HWY_RESTRICT q, const Real* HWY_RESTRICT h, int64_t rows,
                              Real* HWY_RESTRICT x) {
  const Lanes<Real> d;
  using V = hn::Vec<Lanes<Real>>;
  constexpr int kLanes = LaneCount<Real>();
  constexpr int kVectors = Chunk<Real>() / kLanes;
  constexpr int kRows = 8 / kVectors;
  int64_t i = 0;
  const auto rows_at = [&](auto count) {
    constexpr int kCount = decltype(count)::value;
    for (int r = 0; r < kCount; ++r) hwy::Prefetch(q + (i + r) * kBlockWidth + kAhead);
    for (int c = 0; c < kBlockWidth; c += Chunk<Real>()) {
      V sum[kCount][kVectors];
      Real* out = x + i * kBlockWidth + c;
      for (int r = 0; r < kCount; ++r) {
        for (int v = 0; v < kVectors; ++v) {
          sum[r][v] = hn::LoadU(d, out + r * kBlockWidth + v * kLanes);
        }
      }
      for (int k = 0; k < kBlockWidth; ++k) {
        for (int v = 0; v < kVectors; ++v) {
          const V hv = hn::LoadU(d, h + k * kBlockWidth + c + v * kLanes);
          for (int r = 0; r < kCount; ++r) {
            sum[r][v] = hn::NegMulAdd(hn::Set(d, q[(i + r) * kBlockWidth + k]), hv, sum[r][v]);
          }
        }
      }
      for (int r = 0; r < kCount; ++r) {
        for (int v = 0; v < kVectors; ++v) {
          hn::StoreU(sum[r][v], d, out + r * kBlockWidth + v * kLanes);
        }
      }
    }
  };
  for (; i + kRows <= rows; i += kRows) rows_at(std::integral_constant<int, kRows>{});
  for (; i < rows; ++i) rows_at(std::integral_constant<int, 1>{});
}

void ColumnDouble(const double* blocks, const int32_t* rows, int count, int j, const double* x,
                  double* y) {
  MultiplyColumn<double>(blocks, rows, count, j, x, y);
}
void ColumnFloat(const double* blocks, const int32_t* rows, int count, int j, const float* x,
                 double* y) {
  MultiplyColumn<float>(blocks, rows, count, j, x, y);
}
void RowDouble(const double* m, const int32_t* columns, int count, const double* x, double* y) {
  MultiplyRow<double>(m, columns, count, x, y);
}
void RowFloat(const float* m, const int32_t* columns, int count, const float* x, float* y) {
  MultiplyRow<float>(m, columns, count, x, y);
}
void DotDouble(const double* a, const double* b, int64_t rows, double* product) {
  Dot<double>(a, b, rows, product);
}
void DotFloat(const float* a, const float* b, int64_t rows, float* product) {
  Dot<float>(a, b, rows, product);
}
void SubtractDouble(const double* q, const double* h, int64_t rows, double* x) {
  SubtractTimes<double>(q, h, rows, x);
}
void SubtractFloat(const float* q, const float* h, int64_t rows, float* x) {
  SubtractTimes<float>(q, h, rows, x);
}

}  // namespace carillon::precompute::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carillon::precompute {

HWY_EXPORT(ColumnDouble);
HWY_EXPORT(ColumnFloat);
HWY_EXPORT(RowDouble);
HWY_EXPORT(RowFloat);
HWY_EXPORT(DotDouble);
HWY_EXPORT(DotFloat);
HWY_EXPORT(SubtractDouble);
HWY_EXPORT(SubtractFloat);

template <>
void ColumnMultiply<double>(const double* blocks, const int32_t* rows, int count, int j,
                            const double* x, double* y) {
  HWY_DYNAMIC_DISPATCH(ColumnDouble)(blocks, rows, count, j, x, y);
}
template <>
void ColumnMultiply<float>(const double* blocks, const int32_t* rows, int count, int j,
                           const float* x, double* y) {
  HWY_DYNAMIC_DISPATCH(ColumnFloat)(blocks, rows, count, j, x, y);
}

template <>
void RowMultiply<double>(const double* m, const int32_t* columns, int count, const double* x,
                         double* y) {
  HWY_DYNAMIC_DISPATCH(RowDouble)(m, columns, count, x, y);
}
template <>
void RowMultiply<float>(const float* m, const int32_t* columns, int count, const float* x,
                        float* y) {
  HWY_DYNAMIC_DISPATCH(RowFloat)(m, columns, count, x, y);
}
template <>
void BlockDot<double>(const double* a, const double* b, int64_t rows, double* product) {
  HWY_DYNAMIC_DISPATCH(DotDouble)(a, b, rows, product);
}
template <>
void BlockDot<float>(const float* a, const float* b, int64_t rows, float* product) {
  HWY_DYNAMIC_DISPATCH(DotFloat)(a, b, rows, product);
}
template <>
void BlockSubtractTimes<double>(const double* q, const double* h, int64_t rows, double* x) {
  HWY_DYNAMIC_DISPATCH(SubtractDouble)(q, h, rows, x);
}
template <>
void BlockSubtractTimes<float>(const float* q, const float* h, int64_t rows, float* x) {
  HWY_DYNAMIC_DISPATCH(SubtractFloat)(q, h, rows, x);
}

}  // namespace carillon::precompute
#endif
