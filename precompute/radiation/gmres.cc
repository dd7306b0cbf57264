// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/gmres.h"

#include <cmath>
#include <cstddef>
#include <utility>

namespace carillon::precompute {
namespace {

using Complex = std::complex<double>;
using Vector = std::vector<ComplexFloat>;

/// Returns conj(a) . b, summed in double precision.
Complex Inner(const Vector& a, const Vector& b) {
  double real = 0, imag = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const ComplexFloat x = a[i], y = b[i];
    real += static_cast<double>(x.real() * y.real() + x.imag() * y.imag());
    imag += static_cast<double>(x.real() * y.imag() - x.imag() * y.real());
  }
  return {real, imag};
}

double Length(const Vector& a) { return std::sqrt(Inner(a, a).real()); }

void SubtractTimes(const Vector& a, Complex factor, Vector& b) {
  const auto real = static_cast<float>(factor.real()), imag = static_cast<float>(factor.imag());
  for (size_t i = 0; i < a.size(); ++i) {
    b[i] -= ComplexFloat(real * a[i].real() - imag * a[i].imag(),
                         real * a[i].imag() + imag * a[i].real());
  }
}

/// The Krylov space of one right side.
class Krylov {
 public:
  /// `residual` is b - A start.
  Krylov(Vector start, Vector residual, double right_side_length)
      : x_(std::move(start)), right_side_length_(right_side_length) {
    const double length = Length(residual);
    rotated_ = {length};
    if (length > 0) Append(std::move(residual), length);
  }

  double residual() const {
    return right_side_length_ > 0 ? std::abs(rotated_.back()) / right_side_length_ : 0;
  }
  int iterations() const { return static_cast<int>(triangle_.size()); }
  /// Returns whether the last product was zero or not a number, so that another product would bring
  /// no progress.
  bool stuck() const { return stuck_; }

  Vector NextInput(std::span<const ComplexFloat> diagonal) const {
    Vector input = basis_.back();
    for (size_t i = 0; i < input.size(); ++i) input[i] /= diagonal[i];
    return input;
  }

  /// Extends the space by `product`, which is A times the last input.
  void Extend(Vector product) {
    std::vector<Complex> column;
    for (const Vector& v : basis_) {
      column.push_back(Inner(v, product));
      SubtractTimes(v, column.back(), product);
    }
    const double length = Length(product);
    for (size_t i = 0; i < rotations_.size(); ++i) Rotate(rotations_[i], column[i], column[i + 1]);
    const double whole = std::hypot(std::abs(column.back()), length);
    stuck_ = !(whole > 0);
    if (stuck_) return;
    const Rotation rotation{.cosine = std::conj(column.back()) / whole, .sine = length / whole};
    column.back() = whole;
    rotated_.push_back(-rotation.sine * rotated_.back());
    rotated_[rotated_.size() - 2] *= rotation.cosine;
    rotations_.push_back(rotation);
    triangle_.push_back(std::move(column));
    Append(std::move(product), length);
  }

  Vector Solution(std::span<const ComplexFloat> diagonal) const {
    const size_t m = triangle_.size();
    std::vector<Complex> y(m);
    for (size_t i = m; i-- > 0;) {
      Complex sum = rotated_[i];
      for (size_t j = i + 1; j < m; ++j) sum -= triangle_[j][i] * y[j];
      y[i] = sum / triangle_[i][i];
    }
    Vector change(x_.size());
    for (size_t i = 0; i < m; ++i) SubtractTimes(basis_[i], -y[i], change);
    Vector x = x_;
    for (size_t i = 0; i < x.size(); ++i) x[i] += change[i] / diagonal[i];
    return x;
  }

 private:
  struct Rotation {
    Complex cosine;
    double sine;
  };

  static void Rotate(const Rotation& by, Complex& a, Complex& b) {
    const Complex old = a;
    a = by.cosine * old + by.sine * b;
    b = -by.sine * old + std::conj(by.cosine) * b;
  }

  void Append(Vector v, double length) {
    const auto scale = static_cast<float>(length > 0 ? 1 / length : 0);
    for (ComplexFloat& value : v) value *= scale;
    basis_.push_back(std::move(v));
  }

  Vector x_;
  double right_side_length_;
  bool stuck_ = false;
  std::vector<Vector> basis_;
  std::vector<std::vector<Complex>> triangle_;  ///< columns of the triangular factor
  std::vector<Rotation> rotations_;
  std::vector<Complex> rotated_;  ///< the right side in the basis, after the rotations
};

std::vector<Krylov> MakeSpaces(const ApplyMatrix& apply, std::span<const Vector> right_sides,
                               std::span<const Vector> starts) {
  std::vector<Vector> products(starts.size());
  if (!starts.empty()) apply(starts, products);
  std::vector<Krylov> spaces;
  for (size_t s = 0; s < right_sides.size(); ++s) {
    Vector residual = right_sides[s];
    const double length = Length(residual);
    if (!starts.empty()) SubtractTimes(products[s], 1, residual);
    spaces.emplace_back(starts.empty() ? Vector(residual.size()) : starts[s], std::move(residual),
                        length);
  }
  return spaces;
}

}  // namespace

std::vector<GmresSolution> SolveGmres(const ApplyMatrix& apply,
                                      std::span<const ComplexFloat> diagonal,
                                      std::span<const Vector> right_sides,
                                      std::span<const Vector> starts, const GmresOptions& options) {
  std::vector<Krylov> spaces = MakeSpaces(apply, right_sides, starts);
  while (true) {
    std::vector<Krylov*> open;
    std::vector<Vector> inputs;
    for (Krylov& space : spaces) {
      if (space.residual() <= options.tolerance || space.stuck()) continue;
      if (space.iterations() >= options.max_iterations) continue;
      open.push_back(&space);
      inputs.push_back(space.NextInput(diagonal));
    }
    if (open.empty()) break;
    std::vector<Vector> products(inputs.size());
    apply(inputs, products);
    for (size_t i = 0; i < open.size(); ++i) open[i]->Extend(std::move(products[i]));
  }
  std::vector<GmresSolution> solutions;
  solutions.reserve(spaces.size());
  for (const Krylov& space : spaces) {
    solutions.push_back({.x = space.Solution(diagonal),
                         .residual = space.residual(),
                         .iterations = space.iterations()});
  }
  return solutions;
}

}  // namespace carillon::precompute
