// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <iosfwd>

namespace carillon::wind_chimes {

/// One chime: an aluminum tube of the paper's Table 2, named after its note.
struct Tube {
  const char* note;
  double length_m;
};

/// The measured lengths of Table 2.
inline constexpr std::array<Tube, 6> kTubes = {
    {{"D3", 0.505}, {"E3", 0.475}, {"G3", 0.435}, {"A4", 0.410}, {"B4", 0.388}, {"D4", 0.353}}};
inline constexpr double kOuterRadius_m = 0.0125;
inline constexpr double kWall_m = 0.001;
inline constexpr double kDensity_kg_per_m3 = 2700;

/// Writes the closed surface of a tube as OBJ, in metres: its axis is z, its centre the origin.
/// Vertices lie about 5 mm apart along the tube and at 24 corners around. A polygon inscribed in
/// the circle would be a thinner tube and lower in pitch; these have the circle's area.
void WriteTubeMesh(const Tube& tube, std::ostream& out);

}  // namespace carillon::wind_chimes
