// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/graded_size.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <queue>
#include <utility>

#include "precompute/mesh/boundary.h"
#include "precompute/mesh/fill/element_size.h"
#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

double Env(const char* n, double d) { const char* s = getenv(n); return s ? atof(s) : d; }

const double kErrorPower = Env("G_Q", 1.6);
const double kFinest = Env("G_FINE", 0.25), kCoarsest = Env("G_COARSE", 1.2);
const double kGradation = Env("G_GRAD", 0.6);
const double kLeastShare = 1e-4;
const double kStepsPerDoubling = 8;
const double kInside = Env("G_INSIDE", 1.05);
const double kVolumeOfRegular = 0.11785;
const double kSmooth = Env("G_SMOOTH", 0);

struct Neighbours {
  std::vector<std::vector<int32_t>> of;
};

/// The corner nodes of a mesh, with what surrounds them. Other nodes have no neighbours.
std::vector<std::vector<int32_t>> NeighboursOf(const TetMesh& mesh) {
  std::vector<std::vector<int32_t>> neighbours(mesh.nodes.size());
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const int32_t* corners = &mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element)];
    for (const auto& [i, j] : kTetEdges) {
      neighbours[static_cast<size_t>(corners[i])].push_back(corners[j]);
      neighbours[static_cast<size_t>(corners[j])].push_back(corners[i]);
    }
  }
  for (std::vector<int32_t>& of : neighbours) {
    std::ranges::sort(of);
    const auto repeated = std::ranges::unique(of);
    of.erase(repeated.begin(), repeated.end());
  }
  return neighbours;
}

/// Sums over what lies at a node.
struct Sum {
  double value = 0;
  double count = 0;

  void Add(double more) {
    value += more;
    count += 1;
  }
};

/// The element size at each corner node. On the boundary it is the longest edge of a triangle,
/// averaged over the triangles at the node. Inside it is the edge of a regular tetrahedron, of whose
/// volume TetGen makes tetrahedra of the mean volume at the node.
std::vector<double> SizesOf(const TetMesh& mesh) {
  std::vector<Sum> inside(mesh.nodes.size()), outside(mesh.nodes.size());
  const auto at = [&](int32_t node) { return mesh.nodes[static_cast<size_t>(node)]; };
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const int32_t* c = &mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element)];
    const double volume = TetVolume(at(c[0]), at(c[1]), at(c[2]), at(c[3]));
    for (int i = 0; i < 4; ++i) inside[static_cast<size_t>(c[i])].Add(volume);
  }
  for (const BoundaryFace& face : mesh.boundary) {
    const Point a = at(face.nodes[0]), b = at(face.nodes[1]), c = at(face.nodes[2]);
    const double longest = std::max({Distance(a, b), Distance(b, c), Distance(c, a)});
    for (size_t i = 0; i < 3; ++i) outside[static_cast<size_t>(face.nodes[i])].Add(longest);
  }
  std::vector<double> sizes(mesh.nodes.size(), 0);
  for (size_t n = 0; n < sizes.size(); ++n) {
    if (outside[n].count > 0) {
      sizes[n] = outside[n].value / outside[n].count;
    } else if (inside[n].count > 0) {
      sizes[n] = kInside * std::cbrt(inside[n].value / inside[n].count / kVolumeOfRegular);
    }
  }
  return sizes;
}

}  // namespace

SizeField GradedSize(const TetMesh& mesh, const std::vector<double>& error_at_node,
                     const UniformRefinement& uniform) {
  const auto neighbours = NeighboursOf(mesh);
  std::vector<int32_t> corners;
  for (size_t n = 0; n < neighbours.size(); ++n) {
    if (!neighbours[n].empty()) corners.push_back(static_cast<int32_t>(n));
  }
  const auto at = [](auto& v, int32_t n) -> auto& { return v[static_cast<size_t>(n)]; };
  std::vector<double> share = error_at_node;
  for (int s = 0; s < kSmooth; ++s) {
    std::vector<double> smooth = share;
    for (int32_t n : corners) {
      double sum = at(share, n);
      for (int32_t m : at(neighbours, n)) sum += at(share, m);
      at(smooth, n) = sum / (1 + double(at(neighbours, n).size()));
    }
    share = smooth;
  }
  double total = 0;
  for (int32_t n : corners) total += at(share, n);
  const double mean = total / double(corners.size());
  const double q = kErrorPower, d = uniform.dimension;
  for (int32_t n : corners) at(share, n) = std::max(at(share, n) / mean, kLeastShare);
  const double r = uniform.next_element_size_m / uniform.element_size_m;
  const auto factor = [&](int32_t n, double c) {
    return std::clamp(c * std::pow(at(share, n), -1 / (q + d)), kFinest, kCoarsest);
  };
  double low = r / 100, high = r * 100;
  double goal = 0;
  for (int32_t n : corners) goal += at(share, n) * std::pow(r, q);
  for (int step = 0; step < 40; ++step) {
    const double c = std::sqrt(low * high);
    double sum = 0;
    for (int32_t n : corners) sum += at(share, n) * std::pow(factor(n, c), q);
    (sum > goal ? high : low) = c;
  }
  std::vector<double> size = SizesOf(mesh);
  const double bias = 1;
  std::vector<double> wanted(mesh.nodes.size(), 0);
  double nodes = 0, nodes_uniform = 0;
  for (int32_t n : corners) {
    const double x = factor(n, low);
    nodes += std::pow(x, -d), nodes_uniform += std::pow(r, -d);
    const double s = x * at(size, n) * bias / uniform.next_element_size_m;
    at(wanted, n) = std::exp2(std::round(std::log2(s) * kStepsPerDoubling) / kStepsPerDoubling);
  }
  if (getenv("G_LOG")) fprintf(stderr, "graded r %.3f c %.3f nodes %.0f uniform %.0f of %zu d %g\n", r, low, nodes, nodes_uniform, corners.size(), d);
  using Entry = std::pair<double, int32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (int32_t n : corners) queue.emplace(at(wanted, n), n);
  while (!queue.empty()) {
    const auto [w, n] = queue.top();
    queue.pop();
    if (w > at(wanted, n)) continue;
    for (int32_t m : at(neighbours, n)) {
      const double most = w + kGradation * Distance(at(mesh.nodes, n), at(mesh.nodes, m)) / uniform.next_element_size_m;
      if (most < at(wanted, m)) queue.emplace(at(wanted, m) = most, m);
    }
  }
  if (getenv("G_LOG")) {
    double after = 0, sum3 = 0;
    for (int32_t n : corners) {
      const double x = at(wanted, n) / (at(size, n) * bias / uniform.next_element_size_m);
      after += std::pow(x, -d), sum3 += std::pow(x, -3);
    }
    fprintf(stderr, "  after gradation %.0f (cubed %.0f), bias %.3f\n", after, sum3, bias);
  }
  std::vector<Point> points;
  std::vector<double> values;
  for (int32_t n : corners) points.push_back(at(mesh.nodes, n)), values.push_back(at(wanted, n));
  return {std::move(points), std::move(values)};
}

}  // namespace carillon::precompute
