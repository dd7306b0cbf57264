// SPDX-License-Identifier: Apache-2.0
#include "server/scene/sounding_body.h"

#include <future>
#include <utility>

#include "proto/cpp/status_macros.h"
#include "server/excitation/surface_measures.h"

namespace carillon {
namespace {

absl::StatusOr<std::shared_ptr<const SoundingBody>> MakeBody(
    std::shared_ptr<const ModalModel> model) {
  // The two parts are made at the same time, because a client waits for the object.
  auto indexing = std::async([&model] {
    return SurfaceLocator::Make({.vertices = model->vertices,
                                 .triangles = model->triangles,
                                 .given_triangle = model->given_triangle,
                                 .given_vertices = model->given_vertices,
                                 .given_triangles = model->given_triangles});
  });
  ShapeTable shapes(model->shapes, model->vertices.size(), model->mode_count());
  ASSIGN_OR_RETURN(std::unique_ptr<SurfaceLocator> locator, indexing.get());
  const ModalModel& of = *model;
  SurfaceCurvature curvature(of.given_vertices, of.given_triangles);
  const SharpEdges edges(of.given_vertices, curvature.sharp_edges());
  return std::make_shared<const SoundingBody>(
      SoundingBody{.model = std::move(model),
                   .shapes = std::move(shapes),
                   .locator = std::move(locator),
                   .curvature = std::move(curvature),
                   .edges = edges,
                   .volume_m3 = VolumeM3(of.vertices, of.triangles),
                   .extent_m = ExtentM(of.vertices)});
}

}  // namespace

absl::StatusOr<std::shared_ptr<const SoundingBody>> BodyCache::Get(
    std::shared_ptr<const ModalModel> model) {
  const MutexLock lock(&mutex_);
  if (const auto found = bodies_.find(model.get()); found != bodies_.end()) {
    if (std::shared_ptr<const SoundingBody> body = found->second.lock()) return body;
  }
  std::erase_if(bodies_, [](const auto& entry) { return entry.second.expired(); });
  const ModalModel* key = model.get();
  absl::StatusOr<std::shared_ptr<const SoundingBody>> body = MakeBody(std::move(model));
  if (body.ok()) bodies_[key] = *body;
  return body;
}

}  // namespace carillon
