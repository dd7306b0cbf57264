// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <fstream>
#include <map>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "client_sdk/motion/files/motion_scene.h"
#include "proto/cpp/error_reason.h"

namespace carillon::motion {
namespace {

absl::Status BadObj(const std::string& path, size_t line, absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MOTION_MALFORMED",
                 absl::StrCat(path, ":", line, ": ", what));
}

/// Adds a polygon as a fan of triangles.
absl::Status AddFace(const std::vector<std::string>& words, const std::string& path, size_t line,
                     BodySurface& surface) {
  std::vector<uint32_t> corners;
  for (size_t i = 1; i < words.size(); ++i) {
    int64_t index = 0;
    if (!absl::SimpleAtoi(words[i].substr(0, words[i].find('/')), &index)) {
      return BadObj(path, line, "a face has a corner that is no number");
    }
    const auto count = static_cast<int64_t>(surface.vertices_m.size());
    index = index < 0 ? count + index : index - 1;
    if (index < 0 || index >= count) return BadObj(path, line, "a face names no vertex before it");
    corners.push_back(static_cast<uint32_t>(index));
  }
  for (size_t i = 2; i < corners.size(); ++i) {
    surface.triangles.push_back({corners[0], corners[i - 1], corners[i]});
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<BodySurface> ReadObjSurface(const std::string& path) {
  std::ifstream file(path);
  if (!file) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat(path, " cannot be opened"));
  }
  BodySurface surface;
  std::string line;
  for (size_t number = 1; std::getline(file, line); ++number) {
    const std::vector<std::string> words =
        absl::StrSplit(line, absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
    if (words.empty()) continue;
    if (words[0] == "f") {
      if (const absl::Status status = AddFace(words, path, number, surface); !status.ok()) {
        return status;
      }
    }
    if (words[0] != "v") continue;
    Vector vertex;
    for (int axis = 0; axis < 3; ++axis) {
      if (words.size() < 4 ||
          !absl::SimpleAtod(words[static_cast<size_t>(axis) + 1], &vertex[axis])) {
        return BadObj(path, number, "a vertex needs three numbers");
      }
    }
    surface.vertices_m.push_back(vertex);
  }
  if (surface.triangles.empty()) return BadObj(path, 1, "the file has no face");
  return surface;
}

std::string ObjText(const BodySurface& surface) {
  std::string text;
  for (const Vector& v : surface.vertices_m) {
    absl::StrAppendFormat(&text, "v %.9g %.9g %.9g\n", v.x(), v.y(), v.z());
  }
  for (const auto& t : surface.triangles) {
    absl::StrAppend(&text, "f ", t[0] + 1, " ", t[1] + 1, " ", t[2] + 1, "\n");
  }
  return text;
}

/// Sums over the tetrahedra between the origin and each triangle. The covariance of a tetrahedron
/// with a corner at the origin is A C A' |A|, where C has 1/60 on its diagonal and 1/120 beside it
/// (J. Blow and A. Binstock, How to find the inertia tensor of an arbitrary polyhedron, 2004).
SolidMeasures Measure(const BodySurface& surface) {
  SolidMeasures measures;
  const Vector near = surface.vertices_m.front();  // keeps rounding errors small
  const Matrix unit = Matrix::Constant(1.0 / 120) + Matrix(Matrix::Identity() / 120.0);
  Matrix covariance = Matrix::Zero();
  Vector moment = Vector::Zero();
  for (const auto& t : surface.triangles) {
    Matrix corners;
    for (int i = 0; i < 3; ++i)
      corners.col(i) = surface.vertices_m[t[static_cast<size_t>(i)]] - near;
    const double six_volumes = corners.determinant();
    measures.volume_m3 += six_volumes / 6;
    measures.area_m2 +=
        (corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0)).norm() / 2;
    moment += six_volumes / 24 * corners.rowwise().sum();
    covariance += six_volumes * corners * unit * corners.transpose();
  }
  if (measures.volume_m3 <= 0) return measures;
  const Vector centre = moment / measures.volume_m3;
  covariance = covariance / measures.volume_m3 - centre * centre.transpose();
  measures.centre_m = near + centre;
  measures.inertia_per_kg = covariance.trace() * Matrix::Identity() - covariance;
  return measures;
}

bool IsClosed(const BodySurface& surface) {
  std::map<std::pair<uint32_t, uint32_t>, int> runs;
  for (const auto& t : surface.triangles) {
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t a = t[i], b = t[(i + 1) % 3];
      runs[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  for (const auto& [edge, sum] : runs) {
    if (sum != 0) return false;
  }
  return true;
}

void TurnOutward(BodySurface& surface) {
  if (surface.triangles.empty() || !IsClosed(surface) || Measure(surface).volume_m3 >= 0) return;
  for (auto& triangle : surface.triangles) std::swap(triangle[1], triangle[2]);
}

}  // namespace carillon::motion
