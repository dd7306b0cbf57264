// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/boundary_operator.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

constexpr double kFourPi = 4 * std::numbers::pi;
/// Coordinate of the targets that pad the arrays, in half wavelengths. It is far away from every
/// source.
constexpr float kFarAway = 1e4F;

int64_t Padded(size_t count) {
  return (static_cast<int64_t>(count) + kSweepGrain - 1) / kSweepGrain * kSweepGrain;
}

ComplexFloat Narrow(std::complex<double> z) {
  return {static_cast<float>(z.real()), static_cast<float>(z.imag())};
}

}  // namespace

BoundaryOperator::BoundaryOperator(const AcousticSurface& surface, const NearCorrection& near,
                                   const Point& center, double radius_m, double wavenumber)
    : surface_(surface),
      near_(near),
      wavenumber_(wavenumber),
      eta_(1 / std::max(wavenumber, 1 / radius_m)),
      scale_(wavenumber / std::numbers::pi) {
  const auto padded = static_cast<size_t>(Padded(size()));
  for (auto* place : {&targets_.x, &targets_.y, &targets_.z}) place->assign(padded, kFarAway);
  for (auto* normal : {&targets_.nx, &targets_.ny, &targets_.nz}) normal->assign(padded, 0);
  const double normal_scale = eta_ * wavenumber_ * wavenumber_ / scale_;
  for (size_t v = 0; v < size(); ++v) {
    const Point& p = surface.mesh.vertices[v];
    const Point& n = surface.area_vectors[v];
    const double n_scale = surface.areas[v] > 0 ? normal_scale / surface.areas[v] : 0;
    const std::array<float*, 3> place = {&targets_.x[v], &targets_.y[v], &targets_.z[v]};
    const std::array<float*, 3> normal = {&targets_.nx[v], &targets_.ny[v], &targets_.nz[v]};
    for (size_t a = 0; a < 3; ++a) {
      *place[a] = static_cast<float>(scale_ * (p[a] - center[a]));
      *normal[a] = static_cast<float>(n_scale * n[a]);
    }
  }
}

void BoundaryOperator::Apply(std::span<const std::vector<ComplexFloat>> pressures,
                             std::span<std::vector<ComplexFloat>> results, Workers& workers) const {
  const size_t sides = pressures.size(), stride = kSourceHead + sides * kSourceSide;
  std::vector<float> sources(size() * stride);
  std::vector<std::vector<std::array<ComplexFloat, 3>>> curls(sides);
  for (size_t s = 0; s < sides; ++s) {
    curls[s].resize(size());
    LumpedCurls(surface_, pressures[s], curls[s]);
  }
  for (size_t v = 0; v < size(); ++v) {
    float* to = &sources[v * stride];
    for (const auto* place : {&targets_.x, &targets_.y, &targets_.z}) *to++ = (*place)[v];
    for (const double n : surface_.area_vectors[v]) *to++ = static_cast<float>(scale_ * n);
    for (size_t s = 0; s < sides; ++s) {
      for (const ComplexFloat z :
           {pressures[s][v], curls[s][v][0], curls[s][v][1], curls[s][v][2]}) {
        *to++ = z.real();
        *to++ = z.imag();
      }
    }
  }
  const auto padded = static_cast<size_t>(targets_.padded());
  std::vector<float> sums(sides * kSweepSums * padded);
  workers.ForParts(targets_.padded(), kSweepGrain, [&](int64_t begin, int64_t end, int) {
    SweepLeft(targets_, sources.data(), static_cast<int64_t>(size()), static_cast<int>(sides),
              begin, end, sums.data());
  });

  const auto green = static_cast<float>(scale_ / kFourPi);
  const auto own_green = static_cast<float>(wavenumber_ / kFourPi);  // imaginary
  for (size_t s = 0; s < sides; ++s) {
    auto& result = results[s];
    result.assign(size(), 0);
    const float* sum = &sums[s * kSweepSums * padded];
    std::vector<std::array<ComplexFloat, 3>>& field = curls[s];
    for (size_t v = 0; v < size(); ++v) {
      const Point& n = surface_.area_vectors[v];
      const auto own =
          static_cast<float>(eta_ * wavenumber_ * wavenumber_ * wavenumber_ / kFourPi * Dot(n, n));
      const auto area = static_cast<float>(surface_.areas[v]);
      result[v] = area * green * ComplexFloat(sum[v], sum[padded + v]) + own * pressures[s][v];
      for (size_t a = 0; a < 3; ++a) {
        const size_t q = (2 + 2 * a) * padded + v;
        field[v][a] = green * ComplexFloat(sum[q], sum[q + padded]) +
                      ComplexFloat(0, own_green) * field[v][a];
      }
    }
    AddCurlTests(surface_, field, ComplexFloat(0, static_cast<float>(eta_)), result);
    AddMass(pressures[s], result);
    workers.ForParts(static_cast<int64_t>(size()), kSweepGrain,
                     [&](int64_t begin, int64_t end, int) {
                       AddNear(pressures[s], {begin, end}, result);
                     });
  }
}

void BoundaryOperator::AddMass(std::span<const ComplexFloat> p,
                               std::span<ComplexFloat> result) const {
  for (size_t t = 0; t < surface_.mesh.triangles.size(); ++t) {
    const auto& triangle = surface_.mesh.triangles[t];
    const auto weight = static_cast<float>(Norm(surface_.triangle_area_vectors[t]) / 24);
    ComplexFloat sum = 0;
    for (const int32_t v : triangle) sum += p[static_cast<size_t>(v)];
    for (const int32_t v : triangle) {
      result[static_cast<size_t>(v)] += weight * (sum + p[static_cast<size_t>(v)]);
    }
  }
}

void BoundaryOperator::AddNear(std::span<const ComplexFloat> p, std::pair<int64_t, int64_t> rows,
                               std::span<ComplexFloat> result) const {
  const auto eta = static_cast<float>(eta_);
  const auto normals = static_cast<float>(eta_ * wavenumber_ * wavenumber_);
  for (auto v = static_cast<size_t>(rows.first); v < static_cast<size_t>(rows.second); ++v) {
    ComplexFloat sum = 0;
    for (auto e = static_cast<size_t>(near_.row_begin[v]);
         e < static_cast<size_t>(near_.row_begin[v + 1]); ++e) {
      const NearEntry& entry = near_.entries[e];
      const ComplexFloat factor(-entry.double_layer,
                                eta * entry.curls - normals * entry.single_layer);
      sum += factor * p[static_cast<size_t>(near_.columns[e])];
    }
    result[v] += sum;
  }
}

std::vector<std::vector<ComplexFloat>> BoundaryOperator::RightSides(
    std::span<const Displacement> displacements, Workers& workers) const {
  const size_t sides = displacements.size(), stride = 3 + sides;
  std::vector<float> sources(size() * stride);
  for (size_t v = 0; v < size(); ++v) {
    float* to = &sources[v * stride];
    for (const auto* place : {&targets_.x, &targets_.y, &targets_.z}) *to++ = (*place)[v];
    const Point& n = surface_.area_vectors[v];
    for (size_t s = 0; s < sides; ++s) {
      const auto& u = displacements[s][v];
      *to++ = static_cast<float>(n[0] * u[0] + n[1] * u[1] + n[2] * u[2]);
    }
  }
  const auto padded = static_cast<size_t>(targets_.padded());
  std::vector<float> sums(sides * 4 * padded);
  workers.ForParts(targets_.padded(), kSweepGrain, [&](int64_t begin, int64_t end, int) {
    SweepRight(targets_, sources.data(), static_cast<int64_t>(size()), static_cast<int>(sides),
               begin, end, sums.data());
  });

  const std::complex<double> eta(0, eta_);
  const double normal_scale = eta_ * wavenumber_ * wavenumber_ / scale_;
  std::vector<std::vector<ComplexFloat>> results(sides);
  for (size_t s = 0; s < sides; ++s) {
    std::vector<std::complex<double>> right(size());
    const float* sum = &sums[s * 4 * padded];
    for (size_t v = 0; v < size(); ++v) {
      const double area = surface_.areas[v] * scale_ / kFourPi;
      const double own = surface_.areas[v] * wavenumber_ / kFourPi * sources[v * stride + 3 + s];
      right[v] += area * std::complex<double>(sum[v], sum[padded + v]) +
                  std::complex<double>(0, own) +
                  eta * (area * scale_ / normal_scale) *
                      std::complex<double>(sum[2 * padded + v], sum[3 * padded + v]);
      for (auto e = static_cast<size_t>(near_.row_begin[v]);
           e < static_cast<size_t>(near_.row_begin[v + 1]); ++e) {
        const NearEntry& entry = near_.entries[e];
        const auto column = static_cast<size_t>(near_.columns[e]);
        for (size_t a = 0; a < 3; ++a) {
          right[v] += static_cast<double>(entry.source[a] * displacements[s][column][a]);
          right[column] += eta * static_cast<double>(entry.adjoint[a] * displacements[s][v][a]);
        }
      }
    }
    for (size_t t = 0; t < surface_.mesh.triangles.size(); ++t) {
      const auto& triangle = surface_.mesh.triangles[t];
      const Point& n = surface_.triangle_area_vectors[t];
      std::array<double, 3> q{};  // q at the corners, times the area
      for (size_t c = 0; c < 3; ++c) {
        const auto& u = displacements[s][static_cast<size_t>(triangle[c])];
        for (size_t a = 0; a < 3; ++a) q[c] += n[a] * u[a];
      }
      for (size_t c = 0; c < 3; ++c) {
        right[static_cast<size_t>(triangle[c])] += eta * ((q[0] + q[1] + q[2] + q[c]) / 24);
      }
    }
    for (const std::complex<double>& value : right) results[s].push_back(Narrow(-value));
  }
  return results;
}

std::vector<ComplexFloat> BoundaryOperator::Diagonal() const {
  std::vector<ComplexFloat> diagonal(size());
  for (size_t v = 0; v < size(); ++v) {
    diagonal[v] =
        Narrow({-near_.double_layer[v],
                eta_ * (near_.curls[v] - wavenumber_ * wavenumber_ * near_.single_layer[v])});
  }
  for (size_t t = 0; t < surface_.mesh.triangles.size(); ++t) {
    const auto weight = static_cast<float>(Norm(surface_.triangle_area_vectors[t]) / 12);
    for (const int32_t v : surface_.mesh.triangles[t]) diagonal[static_cast<size_t>(v)] += weight;
  }
  // The row of a vertex without a triangle is zero. A diagonal of one then gives p = 0.
  std::ranges::replace(diagonal, ComplexFloat(0), ComplexFloat(1));
  return diagonal;
}

}  // namespace carillon::precompute
