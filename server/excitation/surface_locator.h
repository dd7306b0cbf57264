// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "absl/status/statusor.h"
#include "server/excitation/contact.h"

namespace carillon {

/// The sounding surface of a body and the surface as given. The sounding surface has #V vertices in
/// metres, #T triangles and, for each triangle, the triangle of the given surface on which it lies.
/// Both surfaces must outlive the locator.
struct LocatorSurfaces {
  std::span<const std::array<float, 3>> vertices;
  std::span<const std::array<uint32_t, 3>> triangles;
  std::span<const uint32_t> given_triangle;
  std::span<const std::array<float, 3>> given_vertices;
  std::span<const std::array<uint32_t, 3>> given_triangles;
};

/// A point of the sounding surface.
struct LocatedPoint {
  uint32_t triangle = 0;
  std::array<uint32_t, 3> vertices{};
  std::array<double, 3> weights{};  ///< barycentric
  double distance_m = 0;            ///< distance from the point of the query
};

/// Finds the point of the sounding surface at which a contact acts. Several threads may query at
/// once, except render threads.
class SurfaceLocator {
 public:
  /// Makes a locator. Errors: INVALID_ARGUMENT (MODAL_MODEL_MALFORMED: no triangle, or an index
  /// out of range), RESOURCE_EXHAUSTED (SERVER_OUT_OF_MEMORY).
  static absl::StatusOr<std::unique_ptr<SurfaceLocator>> Make(const LocatorSurfaces& surfaces);
  ~SurfaceLocator();

  /// Returns the point of the sounding surface nearest to `point`, which is in the model's frame
  /// and size, metres. Where several triangles are equally near, it is on the one with the lowest
  /// index. INVALID_ARGUMENT (CONTACT_MALFORMED).
  absl::StatusOr<LocatedPoint> Nearest(const Point& point) const;

  /// Returns the point of the sounding surface that is nearest to `at`, a point on a triangle of
  /// the surface as given. Only the triangles of the sounding surface that lie on that given
  /// triangle are searched. If there are none, because a repair has removed the given triangle, all
  /// are. Errors: INVALID_ARGUMENT (CONTACT_MALFORMED).
  absl::StatusOr<LocatedPoint> OnGivenTriangle(const SurfacePoint& at) const;

 private:
  struct Index;
  explicit SurfaceLocator(std::unique_ptr<Index> index);
  std::unique_ptr<Index> index_;
};

}  // namespace carillon
