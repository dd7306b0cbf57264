// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <iosfwd>

namespace carillon::wind_chimes {

/// A chime: an aluminum tube of the paper's Table 2 with the name of its note.
struct Tube {
  const char* note;
  double length_m;
};

/// The tubes with the measured lengths of Table 2.
inline constexpr std::array<Tube, 6> kTubes = {
    {{"D3", 0.505}, {"E3", 0.475}, {"G3", 0.435}, {"A4", 0.410}, {"B4", 0.388}, {"D4", 0.353}}};
inline constexpr double kOuterRadius_m = 0.0125;
inline constexpr double kWall_m = 0.001;
inline constexpr double kDensity_kg_per_m3 = 2700;

/// Writes the closed surface of a tube as OBJ, in metres. The axis of the tube is z, and its centre
/// is the origin. The rings of vertices are about 5 mm apart and have 24 vertices each. Each ring
/// has the area of the circle: a polygon inscribed in the circle would make the tube thinner and
/// its pitch lower.
void WriteTubeMesh(const Tube& tube, std::ostream& out);

}  // namespace carillon::wind_chimes
