// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/fem/tet_rule.h"

#include <array>

namespace carillon::precompute {
namespace {

using Four = std::array<double, 4>;

/// Places and weights of a rule of four points on [0, 1] for the weight function (1 - x)^k.
struct GaussJacobi {
  Four at;
  Four weight;
};

constexpr GaussJacobi kSquared = {
    {0.048500549446997276, 0.23860073755186234, 0.5170472951043674, 0.7958514178967728},
    {0.11088841561127774, 0.14345878979921445, 0.0686338871729231, 0.010352240749918081}};
constexpr GaussJacobi kLinear = {
    {0.057104196114517725, 0.2768430136381238, 0.5835904323689168, 0.8602401356562195},
    {0.13550691343148852, 0.2034645680102711, 0.12984754760823233, 0.031180970950008085}};
constexpr GaussJacobi kLegendre = {
    {0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262},
    {0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269}};

/// Adds the four points of which one barycentric coordinate differs from the three that are `a`.
void AddAtCorners(double a, double weight, std::vector<TetRulePoint>& rule) {
  for (int i = 0; i < 4; ++i) {
    Eigen::Vector4d at = Eigen::Vector4d::Constant(a);
    at[i] = 1 - 3 * a;
    rule.push_back({at, weight});
  }
}

/// Adds the six points of which two barycentric coordinates are `a` and two are 1/2 - a.
void AddAtEdges(double a, double weight, std::vector<TetRulePoint>& rule) {
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < i; ++j) {
      Eigen::Vector4d at = Eigen::Vector4d::Constant(a);
      at[i] = at[j] = 0.5 - a;
      rule.push_back({at, weight});
    }
  }
}

std::vector<TetRulePoint> MakeDegree5() {
  std::vector<TetRulePoint> rule;
  AddAtCorners(0.31088591926330060980, 0.11268792571801585080, rule);
  AddAtCorners(0.09273525031089122640, 0.07349304311636194934, rule);
  AddAtEdges(0.04550370412564964949, 0.04254602077708146686, rule);
  return rule;
}

std::vector<TetRulePoint> MakeDegree7() {
  std::vector<TetRulePoint> rule;
  for (size_t i = 0; i < 4; ++i) {
    for (size_t j = 0; j < 4; ++j) {
      for (size_t k = 0; k < 4; ++k) {
        const double x = kSquared.at[i], y = (1 - x) * kLinear.at[j];
        const double z = (1 - x - y) * kLegendre.at[k];
        // The volume of the reference tetrahedron is 1/6.
        const double weight = 6 * kSquared.weight[i] * kLinear.weight[j] * kLegendre.weight[k];
        rule.push_back({{1 - x - y - z, x, y, z}, weight});
      }
    }
  }
  return rule;
}

}  // namespace

const std::vector<TetRulePoint>& TetRuleOfDegree5() {
  static const std::vector<TetRulePoint> rule = MakeDegree5();
  return rule;
}

const std::vector<TetRulePoint>& TetRuleOfDegree7() {
  static const std::vector<TetRulePoint> rule = MakeDegree7();
  return rule;
}

}  // namespace carillon::precompute
