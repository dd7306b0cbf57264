// SPDX-License-Identifier: Apache-2.0
#include "server/scene/sounding_body.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/excitation/surface_measures.h"

namespace carillon {
namespace {

/// A physical mode moves no part of a body farther than it would move this share of the mass if
/// that share vibrated alone.
constexpr double kLeastMassShare = 1e-8;

absl::Status NotPhysical(absl::string_view what, double value, double most) {
  return Refusal(
      absl::StatusCode::kFailedPrecondition, "MODAL_MODEL_MALFORMED",
      absl::StrCat("the modal model has ", what, " of ", value,
                   ", but a body of its size has at most ", most, ": compute or export it again"));
}

/// Checks the model's shapes, which have unit modal mass, against its mass. The mass equals the
/// volume, because models are stored for unit density.
absl::Status CheckShapes(const ModalModel& model) {
  const double volume_m3 = VolumeM3(model.vertices, model.triangles);
  if (!(volume_m3 > 0)) return absl::OkStatus();  // the surface is open
  const double most = 1 / std::sqrt(kLeastMassShare * volume_m3);
  float largest = 0;
  for (const float shape : model.shapes) largest = std::max(largest, std::abs(shape));
  if (!(largest <= most)) return NotPhysical("a mode shape", largest, most);
  const double most_coupling = most * AreaM2(model.vertices, model.triangles);
  for (const double coupling : model.couplings) {
    if (!(std::abs(coupling) <= most_coupling)) {
      return NotPhysical("a coupling", coupling, most_coupling);
    }
  }
  return absl::OkStatus();
}

/// Returns the lower triangular root L of a tensor L L^T, or zero if it is not positive.
std::array<Vector3, 3> RootOf(const std::array<Vector3, 3>& tensor) {
  std::array<Vector3, 3> root{};
  for (size_t row = 0; row < 3; ++row) {
    for (size_t column = 0; column <= row; ++column) {
      double rest = tensor[row][column];
      for (size_t k = 0; k < column; ++k) rest -= root[row][k] * root[column][k];
      if (row == column && !(rest > 1e-9 * tensor[row][row])) return {};
      root[row][column] = row == column ? std::sqrt(rest) : rest / root[column][column];
    }
  }
  return root;
}

absl::StatusOr<std::shared_ptr<const SoundingBody>> MakeBody(
    std::shared_ptr<const ModalModel> model) {
  // Two threads make the two parts, because a client waits for the object. The new thread is not
  // the one that makes the locator: Embree keeps 192 bytes for each thread that ever used it.
  auto tabulating = std::async(
      [&model] { return ShapeTable(model->shapes, model->vertices.size(), model->mode_count()); });
  ASSIGN_OR_RETURN(std::unique_ptr<SurfaceLocator> locator,
                   SurfaceLocator::Make({.vertices = model->vertices,
                                         .triangles = model->triangles,
                                         .given_triangle = model->given_triangle,
                                         .given_vertices = model->given_vertices,
                                         .given_triangles = model->given_triangles}));
  RETURN_IF_ERROR(CheckShapes(*model));
  ShapeTable shapes = tabulating.get();
  const ModalModel& of = *model;
  SurfaceCurvature curvature(of.given_vertices, of.given_triangles);
  SharpEdges edges(curvature);
  return std::make_shared<const SoundingBody>(SoundingBody{
      .model = std::move(model),
      .shapes = std::move(shapes),
      .locator = std::move(locator),
      .curvature = std::move(curvature),
      .edges = std::move(edges),
      .volume_m3 = of.regions.empty() ? VolumeM3(of.vertices, of.triangles) : of.mass_kg,
      .centre_m = CentreM(of.vertices, of.triangles),
      .inertia_root = RootOf(InertiaM5(of.vertices, of.triangles)),
      .extent_m = ExtentM(of.vertices)});
}

}  // namespace

Point SoundingBody::At(const LocatedPoint& located) const {
  Point point{};
  for (size_t i = 0; i < 3; ++i) {
    const std::array<float, 3>& vertex = model->vertices[located.vertices[i]];
    for (size_t axis = 0; axis < 3; ++axis) point[axis] += located.weights[i] * vertex[axis];
  }
  return point;
}

absl::StatusOr<std::shared_ptr<const SoundingBody>> BodyCache::Get(
    std::shared_ptr<const ModalModel> model) {
  const ModalModel* const key = model.get();
  std::promise<Made> promise;
  std::shared_future<Made> other;
  {
    const MutexLock lock(&mutex_);
    if (const auto found = bodies_.find(key); found != bodies_.end()) {
      if (std::shared_ptr<const SoundingBody> body = found->second.lock()) return body;
    }
    const auto [making, is_new] = making_.try_emplace(key);
    if (is_new) making->second = promise.get_future().share();
    if (!is_new) other = making->second;
  }
  if (other.valid()) return other.get();
  const absl::Cleanup end = [&] {
    const MutexLock lock(&mutex_);
    making_.erase(key);
  };
  Made body = MakeBody(std::move(model));
  {
    const MutexLock lock(&mutex_);
    std::erase_if(bodies_, [](const auto& entry) { return entry.second.expired(); });
    if (body.ok()) bodies_[key] = *body;
  }
  promise.set_value(body);
  return body;
}

}  // namespace carillon
