// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/sweep_kernels.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "precompute/radiation/sweep_kernels.cc"
// foreach_target.h includes this file once for each target, and must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace carillon::precompute::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;
constexpr int kLanes = std::min(16, static_cast<int>(HWY_MAX_BYTES / sizeof(float)));
/// Number of sources that are summed in registers before the sums are added to memory. This keeps
/// the rounding errors of long sums small.
constexpr int64_t kSourceChunk = 512;
constexpr float kPi = 3.14159265358979F;

/// Number of vectors of targets that are processed at once, so that their sums and the intermediate
/// values fit into registers.
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4 || HWY_TARGET == HWY_SSE2
constexpr int kVectorsOneSide = 1;
#else
constexpr int kVectorsOneSide = 2;
#endif

struct Phase {
  V cosine;
  V sine;
  hn::VFromD<hn::RebindToUnsigned<D>> sign;  ///< sign bit, to be applied to cosine and sine by Xor
};

/// Returns exp(i pi u) except for the sign. The polynomials are near-best within a quarter turn on
/// either side, with an error of 5e-8.
HWY_INLINE Phase HalfTurns(V u) {
  const D d;
  const hn::RebindToSigned<D> di;
  const hn::RebindToUnsigned<D> du;
  const auto nearest = hn::NearestInt(u);
  const V f = hn::Sub(u, hn::ConvertTo(d, nearest));
  const V x = hn::Mul(f, f);
  V sine = hn::MulAdd(x, hn::Set(d, 7.765766031e-02F), hn::Set(d, -5.982912856e-01F));
  V cosine = hn::MulAdd(x, hn::Set(d, 2.196896111e-01F), hn::Set(d, -1.331876568F));
  sine = hn::MulAdd(x, sine, hn::Set(d, 2.550077523F));
  cosine = hn::MulAdd(x, cosine, hn::Set(d, 4.058411353F));
  sine = hn::MulAdd(x, sine, hn::Set(d, -5.167710084F));
  cosine = hn::MulAdd(x, cosine, hn::Set(d, -4.934792831F));
  sine = hn::Mul(f, hn::MulAdd(x, sine, hn::Set(d, 3.141592640F)));
  cosine = hn::MulAdd(x, cosine, hn::Set(d, 0.9999999532F));
  return {cosine, sine, hn::BitCast(du, hn::ShiftLeft<31>(hn::BitCast(di, nearest)))};
}

HWY_INLINE V FlipSign(V v, hn::VFromD<hn::RebindToUnsigned<D>> sign) {
  const D d;
  const hn::RebindToUnsigned<D> du;
  return hn::BitCast(d, hn::Xor(hn::BitCast(du, v), sign));
}

/// The distance between target and source, and the Green function there.
struct Pair {
  V dx, dy, dz;      ///< from target to source
  V inverse;         ///< 1/u; zero where target and source coincide
  V g_real, g_imag;  ///< exp(i pi u)/u
};

HWY_INLINE Pair Between(V x, V y, V z, const float* source) {
  const D d;
  Pair pair;
  pair.dx = hn::Sub(hn::Set(d, source[0]), x);
  pair.dy = hn::Sub(hn::Set(d, source[1]), y);
  pair.dz = hn::Sub(hn::Set(d, source[2]), z);
  const V square =
      hn::MulAdd(pair.dz, pair.dz, hn::MulAdd(pair.dy, pair.dy, hn::Mul(pair.dx, pair.dx)));
  const V guess = hn::ApproximateReciprocalSqrt(square);
  const V half = hn::Mul(hn::Mul(square, hn::Set(d, 0.5F)), guess);
  pair.inverse = hn::Mul(guess, hn::NegMulAdd(half, guess, hn::Set(d, 1.5F)));
#if HWY_TARGET == HWY_NEON || HWY_TARGET == HWY_SSE4 || HWY_TARGET == HWY_SSE2
  // The guess of these instruction sets may have only eight correct bits, so a second Newton step
  // is needed.
  const V again = hn::Mul(hn::Mul(square, hn::Set(d, 0.5F)), pair.inverse);
  pair.inverse = hn::Mul(pair.inverse, hn::NegMulAdd(again, pair.inverse, hn::Set(d, 1.5F)));
#endif
  pair.inverse = hn::IfThenElseZero(hn::Gt(square, hn::Zero(d)), pair.inverse);
  const V u = hn::Mul(square, pair.inverse);
  const Phase phase = HalfTurns(u);
  const V signed_inverse = FlipSign(pair.inverse, phase.sign);
  pair.g_real = hn::Mul(phase.cosine, signed_inverse);
  pair.g_imag = hn::Mul(phase.sine, signed_inverse);
  return pair;
}

HWY_INLINE V Dot(V x, V y, V z, const float* b) {
  const D d;
  return hn::MulAdd(z, hn::Set(d, b[2]),
                    hn::MulAdd(y, hn::Set(d, b[1]), hn::Mul(x, hn::Set(d, b[0]))));
}

/// Adds (real + i imag) * (b[0] + i b[1]) to sum.
HWY_INLINE void AddProduct(V real, V imag, const float* b, V* HWY_RESTRICT sum) {
  const D d;
  const V br = hn::Set(d, b[0]), bi = hn::Set(d, b[1]);
  sum[0] = hn::NegMulAdd(imag, bi, hn::MulAdd(real, br, sum[0]));
  sum[1] = hn::MulAdd(imag, br, hn::MulAdd(real, bi, sum[1]));
}

template <int kSides>
HWY_INLINE void LeftPair(const V* HWY_RESTRICT target, const float* HWY_RESTRICT source,
                         V* HWY_RESTRICT sums) {
  const D d;
  const Pair pair = Between(target[0], target[1], target[2], source);
  const V along = hn::Mul(Dot(pair.dx, pair.dy, pair.dz, source + 3), pair.inverse);
  const V normals = Dot(target[3], target[4], target[5], source + 3);
  const V real = hn::Mul(along, pair.inverse);
  const V imag = hn::MulAdd(hn::Set(d, kPi), along, normals);  // negative
  const V a_real = hn::MulAdd(pair.g_imag, imag, hn::Mul(pair.g_real, real));
  const V a_imag = hn::NegMulAdd(pair.g_real, imag, hn::Mul(pair.g_imag, real));
  for (int s = 0; s < kSides; ++s) {
    const float* side = source + kSourceHead + s * kSourceSide;
    V* HWY_RESTRICT sum = sums + s * kSweepSums;
    AddProduct(a_real, a_imag, side, sum);
    for (int c = 1; c < 4; ++c) AddProduct(pair.g_real, pair.g_imag, side + 2 * c, sum + 2 * c);
  }
}

template <int kSides, int kVectors>
HWY_INLINE void LeftChunk(const SweepTargets& targets, int64_t i, const float* HWY_RESTRICT source,
                          int64_t count, float* HWY_RESTRICT out) {
  const D d;
  constexpr int kSums = kSides * kSweepSums;
  constexpr int kStride = kSourceHead + kSides * kSourceSide;
  V target[kVectors][6];
  V sums[kVectors][kSums];
  for (int v = 0; v < kVectors; ++v) {
    const float* const from[6] = {targets.x.data(),  targets.y.data(),  targets.z.data(),
                                  targets.nx.data(), targets.ny.data(), targets.nz.data()};
    for (int c = 0; c < 6; ++c) target[v][c] = hn::LoadU(d, from[c] + i + v * kLanes);
    for (V& sum : sums[v]) sum = hn::Zero(d);
  }
  for (int64_t j = 0; j < count; ++j, source += kStride) {
    for (int v = 0; v < kVectors; ++v) LeftPair<kSides>(target[v], source, sums[v]);
  }
  for (int v = 0; v < kVectors; ++v) {
    for (int q = 0; q < kSums; ++q) {
      float* to = out + q * targets.padded() + i + v * kLanes;
      hn::StoreU(hn::Add(hn::LoadU(d, to), sums[v][q]), d, to);
    }
  }
}

template <int kSides, int kVectors>
HWY_INLINE void LeftSides(const SweepTargets& targets, const float* sources, int64_t source_count,
                          int64_t begin, int64_t end, float* HWY_RESTRICT sums) {
  constexpr int kStride = kSourceHead + kSides * kSourceSide;
  constexpr int kBlock = kVectors * kLanes;
  for (int q = 0; q < kSides * kSweepSums; ++q) {
    std::fill(sums + q * targets.padded() + begin, sums + q * targets.padded() + end, 0.0F);
  }
  for (int64_t j = 0; j < source_count; j += kSourceChunk) {
    const int64_t j_end = std::min(source_count, j + kSourceChunk);
    for (int64_t i = begin; i < end; i += kBlock) {
      LeftChunk<kSides, kVectors>(targets, i, sources + j * kStride, j_end - j, sums);
    }
  }
}

void Left(const SweepTargets& targets, const float* sources, int64_t source_count, int sides,
          int64_t begin, int64_t end, float* sums) {
  if (sides == 1) {
    LeftSides<1, kVectorsOneSide>(targets, sources, source_count, begin, end, sums);
  } else {
    LeftSides<2, 1>(targets, sources, source_count, begin, end, sums);
  }
}

template <int kSides>
HWY_INLINE void RightSides(const SweepTargets& targets, const float* sources, int64_t source_count,
                           int64_t begin, int64_t end, float* HWY_RESTRICT sums) {
  const D d;
  const V zero = hn::Zero(d), pi = hn::Set(d, kPi);
  for (int64_t i = begin; i < end; i += kLanes) {
    const V x = hn::LoadU(d, targets.x.data() + i), y = hn::LoadU(d, targets.y.data() + i);
    const V z = hn::LoadU(d, targets.z.data() + i), nx = hn::LoadU(d, targets.nx.data() + i);
    const V ny = hn::LoadU(d, targets.ny.data() + i), nz = hn::LoadU(d, targets.nz.data() + i);
    V sum[kSides][4];
    for (auto& side : sum) {
      for (V& s : side) s = zero;
    }
    const float* source = sources;
    for (int64_t j = 0; j < source_count; ++j, source += 3 + kSides) {
      const Pair pair = Between(x, y, z, source);
      const V normal = hn::MulAdd(nz, pair.dz, hn::MulAdd(ny, pair.dy, hn::Mul(nx, pair.dx)));
      const V along = hn::Mul(normal, pair.inverse);
      const V real = hn::Mul(along, pair.inverse), imag = hn::Mul(along, pi);  // negative
      const V a_real = hn::MulAdd(pair.g_imag, imag, hn::Mul(pair.g_real, real));
      const V a_imag = hn::NegMulAdd(pair.g_real, imag, hn::Mul(pair.g_imag, real));
      for (int s = 0; s < kSides; ++s) {
        const V strength = hn::Set(d, source[3 + s]);
        sum[s][0] = hn::MulAdd(pair.g_real, strength, sum[s][0]);
        sum[s][1] = hn::MulAdd(pair.g_imag, strength, sum[s][1]);
        sum[s][2] = hn::MulAdd(a_real, strength, sum[s][2]);
        sum[s][3] = hn::MulAdd(a_imag, strength, sum[s][3]);
      }
    }
    for (int q = 0; q < kSides * 4; ++q) {
      hn::StoreU(sum[q / 4][q % 4], d, sums + q * targets.padded() + i);
    }
  }
}

void Right(const SweepTargets& targets, const float* sources, int64_t source_count, int sides,
           int64_t begin, int64_t end, float* sums) {
  if (sides == 1) {
    RightSides<1>(targets, sources, source_count, begin, end, sums);
  } else {
    RightSides<2>(targets, sources, source_count, begin, end, sums);
  }
}

void Far(const SweepTargets& targets, const float* sources, int64_t source_count, int64_t begin,
         int64_t end, float* sums) {
  const D d;
  for (int64_t i = begin; i < end; i += kLanes) {
    const V x = hn::LoadU(d, targets.x.data() + i), y = hn::LoadU(d, targets.y.data() + i);
    const V z = hn::LoadU(d, targets.z.data() + i);
    V sum[2] = {hn::Zero(d), hn::Zero(d)};
    const float* source = sources;
    for (int64_t j = 0; j < source_count; ++j, source += 9) {
      const Phase phase = HalfTurns(Dot(x, y, z, source));
      const V normal = Dot(x, y, z, source + 3);
      const V real =
          FlipSign(hn::MulSub(normal, hn::Set(d, source[6]), hn::Set(d, source[8])), phase.sign);
      const V imag = FlipSign(hn::Mul(normal, hn::Set(d, source[7])), phase.sign);
      sum[0] = hn::MulAdd(imag, phase.sine, hn::MulAdd(real, phase.cosine, sum[0]));
      sum[1] = hn::NegMulAdd(real, phase.sine, hn::MulAdd(imag, phase.cosine, sum[1]));
    }
    for (int q = 0; q < 2; ++q) hn::StoreU(sum[q], d, sums + q * targets.padded() + i);
  }
}

}  // namespace carillon::precompute::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carillon::precompute {

HWY_EXPORT(Left);
HWY_EXPORT(Right);
HWY_EXPORT(Far);

void SweepLeft(const SweepTargets& targets, const float* sources, int64_t source_count, int sides,
               int64_t begin, int64_t end, float* sums) {
  HWY_DYNAMIC_DISPATCH(Left)(targets, sources, source_count, sides, begin, end, sums);
}

void SweepRight(const SweepTargets& targets, const float* sources, int64_t source_count, int sides,
                int64_t begin, int64_t end, float* sums) {
  HWY_DYNAMIC_DISPATCH(Right)(targets, sources, source_count, sides, begin, end, sums);
}

void SweepFar(const SweepTargets& targets, const float* sources, int64_t source_count,
              int64_t begin, int64_t end, float* sums) {
  HWY_DYNAMIC_DISPATCH(Far)(targets, sources, source_count, begin, end, sums);
}

}  // namespace carillon::precompute
#endif
