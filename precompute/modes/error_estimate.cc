// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/error_estimate.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "precompute/fem/curved_element.h"
#include "precompute/fem/element.h"
#include "precompute/mesh/curved_edges.h"
#include "precompute/modes/added_functions.h"
#include "precompute/modes/curved_integrals.h"
#include "precompute/modes/reentrant_edges.h"
#include "precompute/sparse/dense_blas.h"
#include "precompute/sparse/openblas.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {
namespace {

/// One row for each unknown, so that the rows of an element are close in memory.
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

using Barycentric = Eigen::Vector4d;

/// The constant C of the header, for each order of elements.
constexpr double kLinearConstant = 1.3;
constexpr double kQuadraticConstant = 1.8;
/// Largest error as a fraction of the eigenvalue. If the estimate is larger, the mesh gives no
/// information about the mode.
constexpr double kMostError = 0.99;

/// Power of a mode's error in its weight, see ErrorEstimate.
constexpr double kWeightPower = 2;

/// Residuals are computed in batches of modes that fit into max(kResidualBytes, kTimesShapes * size
/// of the shapes), but of at least kFewestModesAtATime modes. The solver needed more than this in
/// addition to the shapes.
constexpr size_t kResidualBytes = size_t{512} << 20U;
constexpr size_t kTimesShapes = 2;
constexpr size_t kFewestModesAtATime = 8;

/// Integrals of products of two sets of functions over a tetrahedron of volume one.
class ReferenceIntegrals {
 public:
  explicit ReferenceIntegrals(int node_count) {
    ForEachPoint([&](const Barycentric& at, double weight) {
      const std::vector<FunctionAt> base = BaseFunctions(at, node_count);
      const std::vector<FunctionAt> added = AddedFunctions(at, node_count);
      mixed.resize(added.size() * base.size(), Eigen::Matrix4d::Zero());
      own.resize(added.size(), Eigen::Matrix4d::Zero());
      if (mass.size() == 0) mass.setZero(Eigen::Index(added.size()), Eigen::Index(base.size()));
      for (size_t i = 0; i < added.size(); ++i) {
        own[i] += weight * added[i].derivative * added[i].derivative.transpose();
        for (size_t j = 0; j < base.size(); ++j) {
          mixed[i * base.size() + j] +=
              weight * added[i].derivative * base[j].derivative.transpose();
          mass(Eigen::Index(i), Eigen::Index(j)) += weight * added[i].value * base[j].value;
        }
      }
    });
  }

  std::vector<Eigen::Matrix4d> mixed;  ///< [added * #base + base]: products of derivatives
  std::vector<Eigen::Matrix4d> own;    ///< [added]: each added function with itself
  Eigen::MatrixXd mass;                ///< #added by #base

 private:
  /// Uses the product of Gauss-Legendre rules of four points, collapsed onto the tetrahedron. It is
  /// exact for polynomials of degree five.
  template <typename Use>
  static void ForEachPoint(const Use& use) {
    constexpr std::array<double, 4> kAt = {0.0694318442029737, 0.3300094782075719,
                                           0.6699905217924281, 0.9305681557970263};
    constexpr std::array<double, 4> kWeight = {0.1739274225687269, 0.3260725774312731,
                                               0.3260725774312731, 0.1739274225687269};
    for (size_t i = 0; i < 4; ++i) {
      for (size_t j = 0; j < 4; ++j) {
        for (size_t k = 0; k < 4; ++k) {
          const double x = kAt[i], y = (1 - x) * kAt[j], z = (1 - x - y) * kAt[k];
          // The integral is divided by the volume, which is 1/6.
          const double jacobian = 6 * (1 - x) * (1 - x - y);
          use(Barycentric(1 - x - y - z, x, y, z), jacobian * kWeight[i] * kWeight[j] * kWeight[k]);
        }
      }
    }
  }
};

/// Returns a(f, g) of two functions, a 3 by 3 block for their components. It is lambda G + mu G^T +
/// mu tr(G) I with G = vol sum_ij T_ij grad L_i grad L_j^T, where T has the integrals of products
/// of the functions' derivatives.
Eigen::Matrix3d Stiffness(const Eigen::Matrix4d& integrals, const TetGeometry& geometry,
                          const LameConstants& lame) {
  const Eigen::Matrix3d G =
      geometry.volume_m3 * geometry.gradients.transpose() * integrals * geometry.gradients;
  return lame.lambda_pa * G + lame.mu_pa * G.transpose() +
         lame.mu_pa * G.trace() * Eigen::Matrix3d::Identity();
}

/// Numbers the edges and faces of a mesh. The edges and faces of an element are in the order of
/// AddedFunctions.
class Places {
 public:
  explicit Places(const TetMesh& mesh) : added_(mesh.nodes_per_element == 10 ? 10 : 6) {
    absl::flat_hash_map<std::array<int32_t, 3>, int32_t> numbers;
    for (size_t e = 0; e < mesh.element_count(); ++e) {
      const int32_t* corners = &mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element)];
      for (const auto& [a, b] : kTetEdges) {
        Number({corners[a], corners[b], -1}, corners[a] < corners[b] ? 1 : -1, numbers);
      }
      if (added_ == 6) continue;
      for (const auto& [a, b, c] : kTetFaces) {
        Number({corners[a], corners[b], corners[c]}, 1, numbers);
      }
    }
    nodes_.resize(numbers.size());
    for (const auto& [nodes, number] : numbers) nodes_[static_cast<size_t>(number)] = nodes;
  }

  /// Returns for each edge or face whether it is fixed, that is, whether all of its corners are
  /// fixed.
  std::vector<bool> FixedWith(const TetMesh& mesh) const {
    std::vector<bool> node_is_fixed(mesh.nodes.size());
    for (const int32_t node : mesh.fixed) node_is_fixed[static_cast<size_t>(node)] = true;
    std::vector<bool> fixed;
    for (const auto& corners : nodes_) {
      fixed.push_back(std::ranges::all_of(corners, [&](int32_t node) {
        return node < 0 || node_is_fixed[static_cast<size_t>(node)];
      }));
    }
    return fixed;
  }

  /// Returns for each edge or face the largest of the nodes' values at its corners.
  std::vector<double> LargestOf(const std::vector<double>& values) const {
    std::vector<double> largest(nodes_.size());
    for (size_t b = 0; b < nodes_.size(); ++b) {
      for (const int32_t node : nodes_[b]) {
        if (node >= 0) largest[b] = std::max(largest[b], values[static_cast<size_t>(node)]);
      }
    }
    return largest;
  }

  size_t count() const { return nodes_.size(); }
  /// The corners of an edge or face, ascending; for an edge, -1 comes first.
  const std::array<int32_t, 3>& Corners(size_t place) const { return nodes_[place]; }
  size_t added() const { return added_; }
  int32_t Of(size_t element, size_t i) const { return number_[element * added_ + i]; }
  /// An odd function on an edge changes its sign with the edge's direction. The added function of a
  /// linear element is even.
  double Sign(size_t element, size_t i) const {
    return added_ == 6 ? 1.0 : static_cast<double>(sign_[element * added_ + i]);
  }

 private:
  void Number(std::array<int32_t, 3> nodes, int sign,
              absl::flat_hash_map<std::array<int32_t, 3>, int32_t>& numbers) {
    std::ranges::sort(nodes);
    const auto next = static_cast<int32_t>(numbers.size());
    number_.push_back(numbers.try_emplace(nodes, next).first->second);
    sign_.push_back(static_cast<int8_t>(sign));
  }

  size_t added_;
  std::vector<std::array<int32_t, 3>> nodes_;  // the corners; for an edge, -1 comes first
  std::vector<int32_t> number_;
  std::vector<int8_t> sign_;
};

TetGeometry GeometryOf(const TetMesh& mesh, const int32_t* element) {
  Eigen::Matrix<double, 3, 4> corners;
  for (int i = 0; i < 4; ++i) {
    corners.col(i) = Eigen::Vector3d::Map(mesh.nodes[static_cast<size_t>(element[i])].data());
  }
  return MakeTetGeometry(corners);
}

/// Sums the contributions of the elements to each edge and face.
class Estimator {
 public:
  Estimator(const TetMesh& mesh, const BodyMaterials& materials)
      : mesh_(mesh),
        materials_(materials),
        nodes_(static_cast<size_t>(mesh.nodes_per_element)),
        integrals_(mesh.nodes_per_element),
        places_(mesh),
        fixed_(places_.FixedWith(mesh)),
        weights_(places_.LargestOf(PlaceWeights(mesh))),
        stiffness_(places_.count(), Eigen::Matrix3d::Zero()) {
    for (size_t e = 0; e < mesh_.element_count(); ++e) {
      if (IsCurved(mesh_, e)) {
        AddCurved(e);
        continue;
      }
      const TetGeometry geometry = GeometryOf(mesh_, Element(e));
      for (size_t i = 0; i < places_.added(); ++i) {
        stiffness_[static_cast<size_t>(places_.Of(e, i))] +=
            Stiffness(integrals_.own[i], geometry, materials_.LameOf(mesh_, e));
      }
    }
  }

  /// Returns the best number of modes for each thread in one pass over the elements. If memory
  /// allows, one thread takes all modes in one pass, because most of the time of a pass is spent on
  /// the elements.
  Eigen::Index ModesAtATime(const Eigen::MatrixXd& shapes, int thread_count) const {
    const size_t bytes_of_mode = 3 * sizeof(double) * places_.count();
    const size_t shape_bytes = sizeof(double) * static_cast<size_t>(shapes.size());
    const size_t most = std::max(kResidualBytes, kTimesShapes * shape_bytes) / bytes_of_mode;
    if (most >= static_cast<size_t>(shapes.cols())) return std::max<Eigen::Index>(shapes.cols(), 1);
    return static_cast<Eigen::Index>(
        std::max(kFewestModesAtATime, most / static_cast<size_t>(thread_count)));
  }

  /// Returns sum_b w_b r_b^T a(b, b)^-1 r_b for some modes, and adds the weighted parts of each
  /// edge and face to `shares`. `shapes` has a row for each unknown and a column for each mode.
  Eigen::VectorXd Corrections(const Eigen::VectorXd& eigenvalues, const RowMatrix& shapes,
                              Eigen::VectorXd& shares) const {
    RowMatrix residuals =
        RowMatrix::Zero(3 * static_cast<Eigen::Index>(places_.count()), shapes.cols());
    ElementResidual element(static_cast<Eigen::Index>(3 * places_.added()),
                            static_cast<Eigen::Index>(3 * nodes_), shapes.cols());
    for (size_t e = 0; e < mesh_.element_count(); ++e) {
      Fill(e, shapes, element);
      element.Compute(eigenvalues);
      for (size_t i = 0; i < places_.added(); ++i) {
        residuals.middleRows<3>(3 * Eigen::Index{places_.Of(e, i)}) +=
            places_.Sign(e, i) * element.result.middleRows<3>(3 * static_cast<Eigen::Index>(i));
      }
    }
    Eigen::VectorXd sums = Eigen::VectorXd::Zero(shapes.cols());
    for (size_t b = 0; b < places_.count(); ++b) {
      if (fixed_[b]) continue;  // its residual is the reaction force
      const auto r = residuals.middleRows<3>(3 * static_cast<Eigen::Index>(b));
      const Eigen::RowVectorXd part =
          weights_[b] * r.cwiseProduct(stiffness_[b].inverse() * r).colwise().sum();
      sums += part.transpose();
      residuals.row(3 * static_cast<Eigen::Index>(b)) = part;
    }
    const Eigen::VectorXd weights = WeightsOf(eigenvalues, sums);
    for (size_t b = 0; b < places_.count(); ++b) {
      const auto row = static_cast<Eigen::Index>(b);
      if (!fixed_[b]) shares[row] += residuals.row(3 * row) * weights;
    }
    return sums;
  }

  /// Returns the shares of the edges and faces, distributed among their corners.
  std::vector<double> AtNodes(const Eigen::VectorXd& shares) const {
    std::vector<double> at_node(mesh_.nodes.size(), 0);
    for (size_t b = 0; b < places_.count(); ++b) {
      const std::array<int32_t, 3>& corners = places_.Corners(b);
      const double part = shares[static_cast<Eigen::Index>(b)] / (corners[0] < 0 ? 2 : 3);
      for (const int32_t node : corners) {
        if (node >= 0) at_node[static_cast<size_t>(node)] += part;
      }
    }
    return at_node;
  }

  size_t place_count() const { return places_.count(); }

 private:
  /// Computes the residuals of the modes for the added functions of an element, a(b, phi) - m(b,
  /// phi) Lambda.
  struct ElementResidual {
    ElementResidual(Eigen::Index added, Eigen::Index unknowns, Eigen::Index mode_count)
        : stiffness(added, unknowns),
          mass(RowMatrix::Zero(added, unknowns)),
          shapes(unknowns, mode_count),
          inertial(added, mode_count),
          result(added, mode_count) {}

    void Compute(const Eigen::VectorXd& eigenvalues) {
      RowProduct(stiffness, shapes, result);
      RowProduct(mass, shapes, inertial);
      result.array() -= inertial.array().rowwise() * eigenvalues.transpose().array();
    }

    RowMatrix stiffness;  ///< #added by #unknowns
    RowMatrix mass;
    RowMatrix shapes;  ///< #unknowns by #modes
    RowMatrix inertial;
    RowMatrix result;  ///< #added by #modes
  };

  /// Returns the weights of the modes in the local shares, see ErrorEstimate.
  static Eigen::VectorXd WeightsOf(const Eigen::VectorXd& eigenvalues,
                                   const Eigen::VectorXd& sums) {
    return (sums.array() / eigenvalues.array()).pow(kWeightPower) / eigenvalues.array();
  }

  /// Computes z := x y, which for column-major matrices is z^T = y^T x^T.
  static void RowProduct(const RowMatrix& x, const RowMatrix& y, RowMatrix& z) {
    const auto columns = static_cast<int>(y.cols()), inner = static_cast<int>(x.cols());
    blas::Product(columns, static_cast<int>(x.rows()), inner, y.data(), columns, x.data(), inner,
                  z.data(), columns);
  }

  const int32_t* Element(size_t e) const { return &mesh_.elements[e * nodes_]; }

  void AddCurved(size_t e) {
    const Eigen::Matrix<double, 3, 30> own =
        curved_.OfAdded(NodesOf(mesh_, e), materials_.LameOf(mesh_, e));
    for (size_t i = 0; i < places_.added(); ++i) {
      stiffness_[static_cast<size_t>(places_.Of(e, i))] +=
          own.middleCols<3>(static_cast<Eigen::Index>(3 * i));
    }
  }

  void FillCurved(size_t e, const RowMatrix& shapes, ElementResidual& element) const {
    const CurvedIntegrals::Mixed mixed =
        curved_.OfBoth(NodesOf(mesh_, e), materials_.LameOf(mesh_, e));
    const double density = materials_.DensityOf(mesh_, e);
    element.stiffness = mixed.stiffness;
    for (Eigen::Index n = 0; n < 10; ++n) {
      element.shapes.middleRows<3>(3 * n) = shapes.middleRows<3>(3 * Eigen::Index{Element(e)[n]});
      for (Eigen::Index i = 0; i < 10; ++i) {
        element.mass.block<3, 3>(3 * i, 3 * n).diagonal().setConstant(density * mixed.mass(i, n));
      }
    }
  }

  void Fill(size_t e, const RowMatrix& shapes, ElementResidual& element) const {
    if (IsCurved(mesh_, e)) return FillCurved(e, shapes, element);
    const TetGeometry geometry = GeometryOf(mesh_, Element(e));
    const LameConstants& lame = materials_.LameOf(mesh_, e);
    const double mass = materials_.DensityOf(mesh_, e) * geometry.volume_m3;
    for (size_t n = 0; n < nodes_; ++n) {
      const auto column = static_cast<Eigen::Index>(3 * n);
      element.shapes.middleRows<3>(column) = shapes.middleRows<3>(3 * Eigen::Index{Element(e)[n]});
      for (size_t i = 0; i < places_.added(); ++i) {
        const auto row = static_cast<Eigen::Index>(3 * i);
        element.stiffness.block<3, 3>(row, column) =
            Stiffness(integrals_.mixed[i * nodes_ + n], geometry, lame);
        element.mass.block<3, 3>(row, column)
            .diagonal()
            .setConstant(
                mass * integrals_.mass(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(n)));
      }
    }
  }

  const TetMesh& mesh_;
  const BodyMaterials& materials_;
  const size_t nodes_;
  const ReferenceIntegrals integrals_;
  const CurvedIntegrals curved_;
  const Places places_;
  const std::vector<bool> fixed_;
  const std::vector<double> weights_;       // w of each edge or face
  std::vector<Eigen::Matrix3d> stiffness_;  // a(b, b) of each edge or face
};

}  // namespace

ErrorEstimate EstimateFrequencyErrors(const TetMesh& mesh, const BodyMaterials& materials,
                                      const Modes& modes) {
  const Estimator estimator(mesh, materials);
  const double constant = mesh.nodes_per_element == 10 ? kQuadraticConstant : kLinearConstant;
  Eigen::VectorXd errors(modes.eigenvalues.size());
  Workers workers(ThreadCount());
  const Eigen::Index at_a_time = estimator.ModesAtATime(modes.shapes, workers.count());
  const Eigen::Index part_count = (errors.size() + at_a_time - 1) / at_a_time;
  Eigen::MatrixXd shares =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(estimator.place_count()), part_count);
  workers.ForEach(part_count, [&](int64_t part) {
    const Eigen::Index first = part * at_a_time;
    const Eigen::Index count = std::min(at_a_time, errors.size() - first);
    Eigen::VectorXd shares_of_part = Eigen::VectorXd::Zero(shares.rows());
    const Eigen::VectorXd corrections =
        estimator.Corrections(modes.eigenvalues.segment(first, count),
                              modes.shapes.middleCols(first, count), shares_of_part);
    shares.col(part) = shares_of_part;
    const Eigen::ArrayXd relative =
        constant * corrections.array() / modes.eigenvalues.segment(first, count).array();
    // A frequency is proportional to the square root of its eigenvalue.
    errors.segment(first, count) = (1 - relative.min(kMostError)).sqrt().inverse() - 1;
  });
  return {std::move(errors), estimator.AtNodes(shares.rowwise().sum())};
}

}  // namespace carillon::precompute
