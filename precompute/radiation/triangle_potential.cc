// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/triangle_potential.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

Point Scaled(const Point& p, double factor) {
  return {factor * p[0], factor * p[1], factor * p[2]};
}

void AddScaled(const Point& p, double factor, Point& sum) {
  for (size_t a = 0; a < 3; ++a) sum[a] += factor * p[a];
}

/// Returns the integral of 1/r along a straight edge from abscissa s0 to s1, whose ends have the
/// distances r0 and r1. Two formulas are equivalent; the function chooses the formula without
/// cancellation.
double LogAlong(double s0, double s1, double r0, double r1) {
  return s0 + s1 >= 0 ? std::log((r1 + s1) / (r0 + s0)) : std::log((r0 - s0) / (r1 - s1));
}

}  // namespace

TrianglePotential::TrianglePotential(const std::array<Point, 3>& corner) : corner_(corner) {
  const Point area_normal = AreaNormal(corner);
  const double twice_area = Norm(area_normal);
  normal_ = Scaled(area_normal, 1 / twice_area);
  for (size_t e = 0; e < 3; ++e) {
    const Point& from = corner[(e + 1) % 3];
    const Point edge = Difference(corner[(e + 2) % 3], from);
    const double length = Norm(edge);
    const Point along = Scaled(edge, 1 / length);
    edges_[e] = {
        .from = from, .along = along, .outward = Cross(along, normal_), .length_m = length};
    gradient_[e] = Scaled(edges_[e].outward, -length / twice_area);
  }
}

double TrianglePotential::SolidAngle(const Point& x) const {
  const Point a = Difference(corner_[0], x), b = Difference(corner_[1], x);
  const Point c = Difference(corner_[2], x);
  const double la = std::sqrt(Dot(a, a)), lb = std::sqrt(Dot(b, b)), lc = std::sqrt(Dot(c, c));
  const double cosine_part = la * lb * lc + Dot(a, b) * lc + Dot(b, c) * la + Dot(c, a) * lb;
  return 2 * std::atan2(std::abs(Dot(a, Cross(b, c))), cosine_part);
}

TrianglePotentials TrianglePotential::At(const Point& x) const {
  const double height = Dot(Difference(x, corner_[0]), normal_);
  double integral = 0;   // integral of 1/r
  Point first_moment{};  // integral of (y - foot)/r
  Point edge_logs{};     // sum of outward normals times integrals of 1/r along the edges
  for (const Edge& edge : edges_) {
    const Point from_x = Difference(edge.from, x);
    const double s0 = Dot(from_x, edge.along), s1 = s0 + edge.length_m;
    const double t = Dot(from_x, edge.outward);
    const double line_squared = t * t + height * height;
    const double r0 = std::sqrt(line_squared + s0 * s0), r1 = std::sqrt(line_squared + s1 * s1);
    const double log = LogAlong(s0, s1, r0, r1);
    integral += t * log;
    AddScaled(edge.outward, 0.5 * (line_squared * log + s1 * r1 - s0 * r0), first_moment);
    AddScaled(edge.outward, log, edge_logs);
  }
  const double solid_angle = height == 0 ? 0 : SolidAngle(x);
  integral -= std::abs(height) * solid_angle;
  const double signed_angle = std::copysign(solid_angle, height);
  TrianglePotentials result{};
  for (size_t c = 0; c < 3; ++c) {
    // The value at the foot of x of the hat function, which is linear and one at its corner.
    const double hat = 1 + Dot(gradient_[c], Difference(x, corner_[c]));
    result.single[c] = hat * integral + Dot(gradient_[c], first_moment);
    result.doubled[c] = hat * signed_angle - height * Dot(gradient_[c], edge_logs);
  }
  return result;
}

}  // namespace carillon::precompute
