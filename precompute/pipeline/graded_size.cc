// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/graded_size.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

/// Power q of the element size to which local errors are proportional. It is between the powers at
/// re-entrant edges, about 1, and elsewhere, 2.4 (resolution.cc).
constexpr double kLocalPower = 1.6;
/// Limits of the change of an element size from one mesh to the next.
constexpr double kFinest = 0.25, kCoarsest = 1.2;
/// Growth of the element size with the distance. Above 2/3, triangles beside an edge could be split
/// without end while the edge is short enough.
constexpr double kGradation = 0.5;
/// Smallest share of the error that counts, in mean shares.
constexpr double kLeastShare = 1e-4;
/// Sizes are rounded to this part of an octave, so that rounding errors, which depend on the number
/// of threads, do not change the mesh.
constexpr double kStepsPerOctave = 8;
/// The edge of the regular tetrahedron of the volume that TetGen is given as a bound, divided by
/// that of the mean volume which TetGen then makes.
constexpr double kBoundToMean = 1.05;
constexpr double kVolumeOfRegular = 0.11785;  // of a tetrahedron with edges of length 1
constexpr int kBisections = 50;
/// A mesh is graded only if that is predicted to leave at most this part of the nodes. Bells and
/// plates, whose errors are alike everywhere, gain nothing.
constexpr double kMostNodes = 0.75;

/// The sum and the number of values that lie at a node.
struct Sum {
  double value = 0;
  double count = 0;

  void Add(double more) {
    value += more;
    count += 1;
  }
  double Mean() const { return value / count; }
};

/// The corner nodes of a mesh, the element size at each one, and its share of the error in mean
/// shares.
struct Corners {
  std::vector<Point> points;
  std::vector<double> sizes_m;
  std::vector<double> shares;
};

std::vector<Sum> VolumesAtNodes(const TetMesh& mesh) {
  std::vector<Sum> volumes(mesh.nodes.size());
  const auto at = [&](int32_t node) { return mesh.nodes[static_cast<size_t>(node)]; };
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const int32_t* c = &mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element)];
    const double volume = TetVolume(at(c[0]), at(c[1]), at(c[2]), at(c[3]));
    for (size_t i = 0; i < 4; ++i) volumes[static_cast<size_t>(c[i])].Add(volume);
  }
  return volumes;
}

/// The longest edges of the triangles at each node of the boundary.
std::vector<Sum> LongestEdgesAtNodes(const TetMesh& mesh) {
  std::vector<Sum> longest(mesh.nodes.size());
  const auto at = [&](int32_t node) { return mesh.nodes[static_cast<size_t>(node)]; };
  for (const BoundaryFace& face : mesh.boundary) {
    const Point a = at(face.nodes[0]), b = at(face.nodes[1]), c = at(face.nodes[2]);
    const double edge = std::max({Distance(a, b), Distance(b, c), Distance(c, a)});
    for (size_t i = 0; i < 3; ++i) longest[static_cast<size_t>(face.nodes[i])].Add(edge);
  }
  return longest;
}

Corners CornersOf(const TetMesh& mesh, const std::vector<double>& error_at_node) {
  const std::vector<Sum> volumes = VolumesAtNodes(mesh), longest = LongestEdgesAtNodes(mesh);
  Corners corners;
  Sum errors;
  for (size_t n = 0; n < mesh.nodes.size(); ++n) {
    if (volumes[n].count == 0) continue;  // a mid-side node
    corners.points.push_back(mesh.nodes[n]);
    corners.sizes_m.push_back(longest[n].count > 0
                                  ? longest[n].Mean()
                                  : kBoundToMean * std::cbrt(volumes[n].Mean() / kVolumeOfRegular));
    corners.shares.push_back(error_at_node[n]);
    errors.Add(error_at_node[n]);
  }
  for (double& share : corners.shares) {
    share = errors.value > 0 ? std::max(share / errors.Mean(), kLeastShare) : 1;
  }
  return corners;
}

/// Returns the factors x_i of the header, with which the error falls as if all were `uniform`.
std::vector<double> FactorsOf(const std::vector<double>& shares, double uniform, double dimension) {
  std::vector<double> shape, factors(shares.size());
  for (const double share : shares) {
    shape.push_back(std::pow(share, -1 / (kLocalPower + dimension)));
  }
  const auto scale_and_sum = [&](double scale) {
    double error = 0;
    for (size_t i = 0; i < shares.size(); ++i) {
      factors[i] = std::clamp(scale * shape[i], kFinest, kCoarsest);
      error += shares[i] * std::pow(factors[i], kLocalPower);
    }
    return error;
  };
  double error = 0;
  for (const double share : shares) error += share * std::pow(uniform, kLocalPower);
  double low = uniform / 100, high = uniform * 100;
  for (int step = 0; step < kBisections; ++step) {
    const double middle = std::sqrt(low * high);
    (scale_and_sum(middle) > error ? high : low) = middle;
  }
  scale_and_sum(low);
  return factors;
}

/// Returns the predicted number of nodes of a graded mesh, relative to the last mesh.
double NodeGrowth(const SizeField& graded, const Corners& corners,
                  const UniformRefinement& uniform) {
  double nodes = 0;
  for (size_t i = 0; i < corners.points.size(); ++i) {
    const double factor =
        graded.At(corners.points[i]) * uniform.next_element_size_m / corners.sizes_m[i];
    nodes += std::pow(factor, -uniform.dimension);
  }
  return nodes / static_cast<double>(corners.points.size());
}

double Rounded(double size) {
  return std::exp2(std::round(std::log2(size) * kStepsPerOctave) / kStepsPerOctave);
}

}  // namespace

SizeField GradedSize(const TetMesh& mesh, const std::vector<double>& error_at_node,
                     const UniformRefinement& uniform) {
  Corners corners = CornersOf(mesh, error_at_node);
  const std::vector<double> factors = FactorsOf(
      corners.shares, uniform.next_element_size_m / uniform.element_size_m, uniform.dimension);
  std::vector<double> relative_sizes;
  for (size_t i = 0; i < factors.size(); ++i) {
    relative_sizes.push_back(
        Rounded(factors[i] * corners.sizes_m[i] / uniform.next_element_size_m));
  }
  SizeField graded(corners.points, std::move(relative_sizes),
                   kGradation / uniform.next_element_size_m);
  const bool pays = NodeGrowth(graded, corners, uniform) <= kMostNodes * uniform.node_growth;
  return pays ? std::move(graded) : SizeField();
}

}  // namespace carillon::precompute
