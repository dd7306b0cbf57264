// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/complete_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "proto/cpp/status_macros.h"

namespace carillon::interchange {
namespace {

using Vector = std::array<double, 3>;

Vector VertexOf(const StoredModel& model, uint32_t vertex) {
  const float* const x = &model.vertices[3 * size_t{vertex}];
  return {x[0], x[1], x[2]};
}

Vector Difference(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

Vector Cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double Dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Returns the mean of |f| over a triangle on which f is linear with these values at its corners.
/// If one corner has another sign than the two others, f vanishes along a line that cuts this
/// corner off. The mean of f over the part cut off is a third of its value at the corner, and the
/// relative area of that part is the product of the relative lengths of its two edges.
double MeanOfAbsolute(double a, double b, double c) {
  const double mean = (a + b + c) / 3;
  const double least = std::min({a, b, c});
  const double most = std::max({a, b, c});
  if (least >= 0 || most <= 0) return std::abs(mean);
  const double middle = a + b + c - least - most;
  const double alone = middle > 0 ? least : most;
  const double other = middle > 0 ? most : least;
  const double cut = alone / (alone - middle) * (alone / (alone - other)) * alone / 3;
  return std::abs(mean - cut) + std::abs(cut);
}

/// c_m = Lambda_m^(1/2) * integral of |n . phi_m| dA (O'Brien et al. 2002, 3.4), exact for shapes
/// that are linear on each triangle. #m.
std::vector<double> Couplings(const StoredModel& model) {
  const size_t modes = model.mode_count();
  std::vector<double> couplings(modes, 0.0);
  for (size_t t = 0; t < model.triangle_count(); ++t) {
    const uint32_t* const corner = &model.triangles[3 * t];
    const Vector origin = VertexOf(model, corner[0]);
    // The normal, whose length is twice the area.
    const Vector normal = Cross(Difference(VertexOf(model, corner[1]), origin),
                                Difference(VertexOf(model, corner[2]), origin));
    const auto flow = [&](uint32_t vertex, size_t mode) {
      const float* const shape = &model.shapes[3 * size_t{vertex} * modes + mode];
      return Dot(normal, {shape[0], shape[modes], shape[2 * modes]});
    };
    for (size_t m = 0; m < modes; ++m) {
      couplings[m] +=
          MeanOfAbsolute(flow(corner[0], m), flow(corner[1], m), flow(corner[2], m)) / 2;
    }
  }
  for (size_t m = 0; m < modes; ++m) couplings[m] *= std::sqrt(model.eigenvalues[m]);
  return couplings;
}

/// Returns the volume in m^3 by the divergence theorem. It is meaningless if the surface is not
/// closed.
double EnclosedVolume(const StoredModel& model) {
  double volume = 0;
  for (size_t t = 0; t < model.triangle_count(); ++t) {
    const uint32_t* const corner = &model.triangles[3 * t];
    volume += Dot(VertexOf(model, corner[0]),
                  Cross(VertexOf(model, corner[1]), VertexOf(model, corner[2])));
  }
  return volume / 6;
}

/// Makes the sounding surface the surface as given, triangle by triangle.
void GiveSoundingSurface(StoredModel& model) {
  model.given_vertices = model.vertices;
  model.given_triangles = model.triangles;
  model.given_triangle.resize(model.triangle_count());
  std::iota(model.given_triangle.begin(), model.given_triangle.end(), 0U);
}

}  // namespace

absl::Status Complete(StoredModel& model) {
  v1::ModalModelHeader& header = model.header;
  if (model.residuals.empty()) {
    model.residuals.assign(model.mode_count(), header.verification().max_residual());
  }
  if (model.given_triangle.empty()) GiveSoundingSurface(model);
  // The array has the right size, so that Validate() checks the others before they are used.
  const bool coupled = !model.couplings.empty();
  if (!coupled) model.couplings.assign(model.mode_count(), 0.0);
  RETURN_IF_ERROR(Validate(model));
  if (!coupled) model.couplings = Couplings(model);
  if (header.complete_to_eigenvalue() == 0) {
    header.set_complete_to_eigenvalue(model.eigenvalues.back());
  }
  if (header.volume_m3() == 0) header.set_volume_m3(std::abs(EnclosedVolume(model)));
  if (static_cast<size_t>(header.estimated_errors_size()) != model.mode_count()) {
    header.clear_estimated_errors();
  }
  if (static_cast<size_t>(header.poisson_slopes_size()) != model.mode_count()) {
    header.clear_poisson_slopes();
  }
  return absl::OkStatus();
}

}  // namespace carillon::interchange
