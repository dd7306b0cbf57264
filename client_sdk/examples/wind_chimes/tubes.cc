// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/examples/wind_chimes/tubes.h"

#include <cmath>
#include <numbers>
#include <ostream>

#include "absl/strings/str_format.h"

namespace carillon::wind_chimes {
namespace {

constexpr int kAround = 24;
constexpr double kRingDistance_m = 0.005;

/// Circumradius of the regular polygon with the area of a circle of radius r:
/// r' = r sqrt((2 pi/n)/sin(2 pi/n)).
double PolygonRadius(double r) {
  const double angle = 2 * std::numbers::pi / kAround;
  return r * std::sqrt(angle / std::sin(angle));
}

/// Writes the rings of one wall, from the lower end to the upper.
void WriteRings(double radius_m, double length_m, int rings, std::ostream& out) {
  for (int ring = 0; ring < rings; ++ring) {
    const double z = length_m * (static_cast<double>(ring) / (rings - 1) - 0.5);
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2 * std::numbers::pi * i / kAround;
      out << absl::StrFormat("v %.9f %.9f %.9f\n", radius_m * std::cos(angle),
                             radius_m * std::sin(angle), z);
    }
  }
}

/// Writes the band between two rings, given by their first vertices (from 0), as triangles whose
/// outside is on the left of the way from `low` to `high` seen along the ring's sense.
void WriteBand(int low, int high, std::ostream& out) {
  for (int i = 0; i < kAround; ++i) {
    const int next = (i + 1) % kAround;
    const int a = low + i + 1, b = low + next + 1, c = high + next + 1, d = high + i + 1;
    out << "f " << a << ' ' << b << ' ' << c << "\nf " << a << ' ' << c << ' ' << d << '\n';
  }
}

}  // namespace

void WriteTubeMesh(const Tube& tube, std::ostream& out) {
  const int rings = static_cast<int>(std::lround(tube.length_m / kRingDistance_m)) + 1;
  out << "# Carillon wind chime " << tube.note << ", metres\n";
  WriteRings(PolygonRadius(kOuterRadius_m), tube.length_m, rings, out);
  WriteRings(PolygonRadius(kOuterRadius_m - kWall_m), tube.length_m, rings, out);
  const int inner = rings * kAround;  // first vertex of the inner wall
  const int last = (rings - 1) * kAround;
  for (int ring = 0; ring + 1 < rings; ++ring) {
    WriteBand(ring * kAround, (ring + 1) * kAround, out);
    WriteBand(inner + (ring + 1) * kAround, inner + ring * kAround, out);
  }
  WriteBand(inner, 0, out);
  WriteBand(last, inner + last, out);
}

}  // namespace carillon::wind_chimes
