// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/error_estimate.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "precompute/fem/assembly.h"
#include "precompute/fem/curved_element.h"
#include "precompute/fem/element.h"
#include "precompute/fem/tet_rule.h"
#include "precompute/mesh/curved_edges.h"
#include "precompute/modes/added_functions.h"
#include "precompute/modes/curved_integrals.h"
#include "precompute/modes/mode_rows.h"
#include "precompute/modes/patch_kernels.h"
#include "precompute/modes/places.h"
#include "precompute/modes/reentrant_edges.h"
#include "precompute/sparse/openblas.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {
namespace {

/// The constant C of the header, for each order of elements.
constexpr double kLinearConstant = 1.3;
constexpr double kQuadraticConstant = 1.8;
/// Largest error as a fraction of the eigenvalue. If the estimate is larger, the mesh gives no
/// information about the mode.
constexpr double kMostError = 0.99;

/// Power of a mode's error in its weight, see ErrorEstimate.
constexpr double kWeightPower = 2;

/// Number of places that a thread takes at a time. The sums of these are added in their order, so
/// that they do not depend on the number of threads.
constexpr size_t kPlacesAtATime = 4096;

/// Integrals of products of two sets of functions over a tetrahedron of volume one.
class ReferenceIntegrals {
 public:
  explicit ReferenceIntegrals(int node_count) {
    std::vector<Eigen::Matrix4d> derivatives;  // products of those of both functions
    for (const auto& [at, weight] : TetRuleOfDegree5()) {
      const std::vector<FunctionAt> base = BaseFunctions(at, node_count);
      const std::vector<FunctionAt> added = AddedFunctions(at, node_count);
      derivatives.resize(added.size() * base.size(), Eigen::Matrix4d::Zero());
      own.resize(added.size(), Eigen::Matrix4d::Zero());
      if (mass.size() == 0) mass.setZero(Eigen::Index(added.size()), Eigen::Index(base.size()));
      for (size_t i = 0; i < added.size(); ++i) {
        own[i] += weight * added[i].derivative * added[i].derivative.transpose();
        for (size_t j = 0; j < base.size(); ++j) {
          derivatives[i * base.size() + j] +=
              weight * added[i].derivative * base[j].derivative.transpose();
          mass(Eigen::Index(i), Eigen::Index(j)) += weight * added[i].value * base[j].value;
        }
      }
    }
    for (const Eigen::Matrix4d& products : derivatives) mixed.emplace_back(products);
  }

  /// The integrals for an added and an own function. An own function depends on one or two of the
  /// barycentric coordinates.
  struct Mixed {
    explicit Mixed(const Eigen::Matrix4d& products) {
      for (Eigen::Index k = 0; k < 4; ++k) {
        if (products.col(k).isZero(0)) continue;
        coordinates[static_cast<size_t>(count)] = k;
        columns.col(count++) = products.col(k);
      }
    }

    Eigen::Index count = 0;
    std::array<Eigen::Index, 2> coordinates = {};  ///< on which the own function depends
    Eigen::Matrix<double, 4, 2> columns;           ///< by the added function's coordinates
  };

  std::vector<Mixed> mixed;          ///< [added * #base + base]: products of derivatives
  std::vector<Eigen::Matrix4d> own;  ///< [added]: each added function with itself
  Eigen::MatrixXd mass;              ///< #added by #base
};

/// Returns a(f, g) of two functions, a 3 by 3 block for their components, where `integrals` has the
/// integrals of products of the functions' derivatives.
Eigen::Matrix3d Stiffness(const Eigen::Matrix4d& integrals, const TetGeometry& geometry,
                          const LameConstants& lame) {
  return StiffnessBlock(
      geometry.volume_m3 * geometry.gradients.transpose() * integrals * geometry.gradients, lame);
}

Eigen::Matrix3d Stiffness(const ReferenceIntegrals::Mixed& integrals, const TetGeometry& geometry,
                          const LameConstants& lame) {
  Eigen::Matrix3d outer = Eigen::Matrix3d::Zero();
  for (Eigen::Index k = 0; k < integrals.count; ++k) {
    const Eigen::Vector3d along = geometry.gradients.transpose() * integrals.columns.col(k);
    outer += geometry.volume_m3 * along *
             geometry.gradients.row(integrals.coordinates[static_cast<size_t>(k)]);
  }
  return StiffnessBlock(outer, lame);
}

/// The nodes whose motions count for the residual at each place: those of the elements at the
/// place.
class Patches {
 public:
  Patches(const TetMesh& mesh, const Places& places) : start_(places.count() + 1) {
    const auto node_count = static_cast<size_t>(mesh.nodes_per_element);
    std::vector<size_t> element_start(places.count() + 1);
    const size_t total = mesh.element_count() * places.of_element();
    for (size_t k = 0; k < total; ++k) ++element_start[places.Of(0, k) + 1];
    for (size_t b = 0; b < places.count(); ++b) element_start[b + 1] += element_start[b];
    std::vector<size_t> elements(total), next(element_start.begin(), element_start.end() - 1);
    for (size_t k = 0; k < total; ++k) elements[next[places.Of(0, k)]++] = k / places.of_element();
    for (size_t b = 0; b < places.count(); ++b) {
      for (size_t k = element_start[b]; k < element_start[b + 1]; ++k) {
        const int32_t* const nodes = &mesh.elements[elements[k] * node_count];
        for (size_t n = 0; n < node_count; ++n) {
          const auto first = nodes_.begin() + static_cast<ptrdiff_t>(start_[b]);
          if (std::find(first, nodes_.end(), nodes[n]) == nodes_.end()) nodes_.push_back(nodes[n]);
        }
      }
      start_[b + 1] = nodes_.size();
    }
    blocks_.resize(nodes_.size());
  }

  Patch Of(size_t place) const {
    const size_t first = start_[place];
    return {std::span(nodes_).subspan(first, start_[place + 1] - first), &blocks_[first]};
  }

  void Add(size_t place, int32_t node, const Eigen::Matrix3d& stiffness, double mass) {
    const auto first = nodes_.begin() + static_cast<ptrdiff_t>(start_[place]);
    PatchBlock& block =
        blocks_[static_cast<size_t>(std::find(first, nodes_.end(), node) - nodes_.begin())];
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(block.stiffness.data()) += stiffness;
    block.mass += mass;
  }

 private:
  std::vector<size_t> start_;  // index of each place's first node
  std::vector<int32_t> nodes_;
  std::vector<PatchBlock> blocks_;
};

/// The residual of a mode at each edge and face, r_b = a(b, phi) - Lambda m(b, phi), as a sum over
/// nodes.
class Estimator {
 public:
  Estimator(const TetMesh& mesh, const BodyMaterials& materials)
      : mesh_(mesh),
        materials_(materials),
        nodes_(static_cast<size_t>(mesh.nodes_per_element)),
        integrals_(mesh.nodes_per_element),
        places_(mesh),
        patches_(mesh, places_),
        flexibility_(places_.count()) {
    std::vector<Eigen::Matrix3d> own(places_.count(), Eigen::Matrix3d::Zero());
    for (size_t e = 0; e < mesh_.element_count(); ++e) {
      if (IsCurved(mesh_, e)) {
        AddCurved(e, own);
      } else {
        AddStraight(e, own);
      }
    }
    const std::vector<double> weights = places_.LargestOf(PlaceWeights(mesh));
    const std::vector<bool> fixed = places_.FixedWith(mesh);
    for (size_t b = 0; b < places_.count(); ++b) {
      flexibility_[b] = {};
      if (fixed[b]) continue;  // its residual is the reaction force
      Eigen::Matrix3d::Map(flexibility_[b].data()) = weights[b] * own[b].inverse();
    }
  }

  /// Returns sum_b w_b r_b^T a(b, b)^-1 r_b for `count` modes, and adds the weighted parts of each
  /// edge and face to `shares`.
  Eigen::VectorXd Corrections(const Modes& modes, Eigen::Index first, Eigen::Index count,
                              Workers& workers, std::vector<double>& shares) const {
    const ModeRows some(modes, first, count);
    const ShapeRows rows = some.rows();
    const Eigen::Index width = rows.mode_count;
    const size_t group_count = (places_.count() + kPlacesAtATime - 1) / kPlacesAtATime;
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(width, static_cast<Eigen::Index>(group_count));
    std::vector<float> parts(places_.count() * static_cast<size_t>(width));
    workers.ForEach(static_cast<int64_t>(group_count), [&](int64_t group) {
      const size_t begin = static_cast<size_t>(group) * kPlacesAtATime;
      const size_t end = std::min(begin + kPlacesAtATime, places_.count());
      for (size_t b = begin; b < end; ++b) {
        AddPatchParts(patches_.Of(b), flexibility_[b], rows, sums.col(group).data(),
                      &parts[b * static_cast<size_t>(width)]);
      }
    });
    Eigen::VectorXd all = sums.rowwise().sum().head(count);
    const Eigen::VectorXf weights =
        WeightsOf(modes.eigenvalues.segment(first, count), all).cast<float>();
    for (size_t b = 0; b < places_.count(); ++b) {
      const auto of_place = Eigen::VectorXf::Map(&parts[b * static_cast<size_t>(width)], count);
      shares[b] += static_cast<double>(of_place.dot(weights));
    }
    return all;
  }

  /// Returns the shares of the edges and faces, distributed among their corners.
  std::vector<double> AtNodes(const std::vector<double>& shares) const {
    return places_.AtNodes(mesh_, shares);
  }

  size_t place_count() const { return places_.count(); }

 private:
  /// Returns the weights of the modes in the local shares, see ErrorEstimate.
  static Eigen::VectorXd WeightsOf(const Eigen::VectorXd& eigenvalues,
                                   const Eigen::VectorXd& sums) {
    return (sums.array() / eigenvalues.array()).pow(kWeightPower) / eigenvalues.array();
  }

  const int32_t* Element(size_t e) const { return &mesh_.elements[e * nodes_]; }

  void AddCurved(size_t e, std::vector<Eigen::Matrix3d>& own) {
    const LameConstants& lame = materials_.LameOf(mesh_, e);
    const TenNodes nodes = NodesOf(mesh_, e);
    const Eigen::Matrix<double, 3, 30> of_added = curved_.OfAdded(nodes, lame);
    const CurvedIntegrals::Mixed mixed = curved_.OfBoth(nodes, lame);
    const double density = materials_.DensityOf(mesh_, e);
    for (Eigen::Index i = 0; i < 10; ++i) {
      const size_t place = places_.Of(e, static_cast<size_t>(i));
      const double sign = places_.Sign(e, static_cast<size_t>(i));
      own[place] += of_added.middleCols<3>(3 * i);
      for (Eigen::Index n = 0; n < 10; ++n) {
        patches_.Add(place, Element(e)[n], sign * mixed.stiffness.block<3, 3>(3 * i, 3 * n),
                     sign * density * mixed.mass(i, n));
      }
    }
  }

  void AddStraight(size_t e, std::vector<Eigen::Matrix3d>& own) {
    const TetGeometry geometry = GeometryOf(mesh_, e);
    const LameConstants& lame = materials_.LameOf(mesh_, e);
    const double mass = materials_.DensityOf(mesh_, e) * geometry.volume_m3;
    for (size_t i = 0; i < places_.of_element(); ++i) {
      const size_t place = places_.Of(e, i);
      const double sign = places_.Sign(e, i);
      own[place] += Stiffness(integrals_.own[i], geometry, lame);
      for (size_t n = 0; n < nodes_; ++n) {
        const double part =
            integrals_.mass(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(n));
        patches_.Add(place, Element(e)[n],
                     sign * Stiffness(integrals_.mixed[i * nodes_ + n], geometry, lame),
                     sign * mass * part);
      }
    }
  }

  const TetMesh& mesh_;
  const BodyMaterials& materials_;
  const size_t nodes_;
  const ReferenceIntegrals integrals_;
  const CurvedIntegrals curved_;
  const Places places_;
  Patches patches_;
  std::vector<std::array<double, 9>> flexibility_;  // w a(b, b)^-1 of each edge or face
};

}  // namespace

ErrorEstimate EstimateFrequencyErrors(const TetMesh& mesh, const BodyMaterials& materials,
                                      const Modes& modes) {
  const Estimator estimator(mesh, materials);
  const double constant = mesh.nodes_per_element == 10 ? kQuadraticConstant : kLinearConstant;
  Eigen::VectorXd errors(modes.eigenvalues.size());
  std::vector<double> shares(estimator.place_count());
  Workers workers(ThreadCount());
  for (Eigen::Index first = 0; first < errors.size(); first += ModeRows::kAtATime) {
    const Eigen::Index count = std::min(ModeRows::kAtATime, errors.size() - first);
    const Eigen::VectorXd corrections = estimator.Corrections(modes, first, count, workers, shares);
    const Eigen::ArrayXd relative =
        constant * corrections.array() / modes.eigenvalues.segment(first, count).array();
    // A frequency is proportional to the square root of its eigenvalue.
    errors.segment(first, count) = (1 - relative.min(kMostError)).sqrt().inverse() - 1;
  }
  return {std::move(errors), estimator.AtNodes(shares)};
}

}  // namespace carillon::precompute
