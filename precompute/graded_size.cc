// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/graded_size.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <queue>
#include <utility>

#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

double Env(const char* n, double d) { const char* s = getenv(n); return s ? atof(s) : d; }

const double kErrorPower = Env("G_Q", 2.4);
const double kFinest = Env("G_FINE", 0.25), kCoarsest = Env("G_COARSE", 1.4);
const double kGradation = Env("G_GRAD", 0.4);
const double kLeastShare = 1e-4;
const double kStepsPerDoubling = 8;
const double kSmooth = Env("G_SMOOTH", 1);

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

/// The longest edge of each element, averaged over the elements at each node.
std::vector<double> SizesOf(const TetMesh& mesh) {
  std::vector<double> sums(mesh.nodes.size(), 0), counts(mesh.nodes.size(), 0);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const int32_t* corners = &mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element)];
    const auto at = [&](int i) { return mesh.nodes[static_cast<size_t>(corners[i])]; };
    double longest = 0;
    for (const auto& [i, j] : kTetEdges) longest = std::max(longest, Distance(at(i), at(j)));
    for (int i = 0; i < 4; ++i) {
      sums[static_cast<size_t>(corners[i])] += longest;
      counts[static_cast<size_t>(corners[i])] += 1;
    }
  }
  for (size_t n = 0; n < sums.size(); ++n) sums[n] /= std::max(counts[n], 1.0);
  return sums;
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
  double area = 0, longest = 0;
  for (const BoundaryFace& f : mesh.boundary) {
    std::array<Point, 3> p;
    double mine = 0;
    for (size_t i = 0; i < 3; ++i) {
      p[i] = at(mesh.nodes, f.nodes[i]);
      mine += at(size, f.nodes[i]) / 3;
    }
    const double a = Norm(AreaNormal(p));
    area += a, longest += a * mine;
  }
  const double bias = uniform.element_size_m / (longest / area);
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
  std::vector<Point> points;
  std::vector<double> values;
  for (int32_t n : corners) points.push_back(at(mesh.nodes, n)), values.push_back(at(wanted, n));
  return {std::move(points), std::move(values)};
}

}  // namespace carillon::precompute
