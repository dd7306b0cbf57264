// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <vector>

#include "precompute/modes/deformation_modes.h"
#include "tests/physics/natural_frequencies.h"

namespace carillon::precompute {

/// How a bar along the x axis moves, told from the shape of the mode.
enum class Family { kLongitudinal, kTorsional, kBending };

/// Which motion of its cross-sections a mode is most of: along the axis, about it, or across it.
/// Each cross-section of nodes with one x gives its mean displacement and its mean rotation about
/// the axis, which goes through (y, z).
inline Family FamilyOf(const TetMesh& mesh, const Eigen::VectorXd& shape, double y, double z) {
  struct Section {
    double count = 0, r2 = 0, moment = 0;
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
  };
  std::map<int64_t, Section> sections;
  for (size_t n = 0; n < mesh.nodes.size(); ++n) {
    const Point& p = mesh.nodes[n];
    const auto u = shape.segment<3>(3 * static_cast<Eigen::Index>(n));
    const double dy = p[1] - y;
    const double dz = p[2] - z;
    Section& section = sections[std::llround(p[0] * 1e6)];
    section.count += 1;
    section.r2 += dy * dy + dz * dz;
    section.moment += dy * u[2] - dz * u[1];
    section.u += u;
  }
  double along = 0, about = 0, across = 0;
  for (const auto& [x, section] : sections) {
    along += section.u[0] * section.u[0] / section.count;
    across += section.u.tail<2>().squaredNorm() / section.count;
    about += section.moment * section.moment / section.r2;
  }
  if (along > about && along > across) return Family::kLongitudinal;
  return about > across ? Family::kTorsional : Family::kBending;
}

/// A bar whose axis goes through (y, z), and its modes.
struct BarModes {
  TetMesh mesh;
  DeformationModes modes;
  double y = 0, z = 0;

  /// Natural frequencies of one family, Hz, ascending.
  std::vector<double> Of(Family family) const {
    std::vector<double> result;
    const std::vector<double> all = FrequenciesHz(modes);
    for (size_t m = 0; m < all.size(); ++m) {
      const auto column = static_cast<Eigen::Index>(m);
      if (FamilyOf(mesh, modes.modes.shapes.col(column), y, z) == family) result.push_back(all[m]);
    }
    return result;
  }
};

}  // namespace carillon::precompute
