// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/fixture_codec.h"

namespace carillon::precompute {
namespace {

Point ToPoint(const v1::Vec3& v) { return {v.x(), v.y(), v.z()}; }

void Set(const Point& p, v1::Vec3& v) {
  v.set_x(p[0]);
  v.set_y(p[1]);
  v.set_z(p[2]);
}

/// Fills in the message, whatever the fixture is.
struct Writer {
  void operator()(const HeldVertices& vertices) const {
    for (const int64_t number : vertices.numbers) {
      fixture.mutable_vertices()->add_indices(static_cast<uint32_t>(number));
    }
  }
  void operator()(const HeldPlane& plane) const {
    Set(plane.point_m, *fixture.mutable_plane()->mutable_point_m());
    Set(plane.normal, *fixture.mutable_plane()->mutable_normal());
  }
  void operator()(const HeldBox& box) const {
    Set(box.low_m, *fixture.mutable_box()->mutable_low_m());
    Set(box.high_m, *fixture.mutable_box()->mutable_high_m());
  }
  void operator()(const HeldGroup& group) const { fixture.set_group(group.name); }

  v1::Fixture& fixture;
};

}  // namespace

Fixture FromProto(const v1::Fixture& said) {
  if (said.has_vertices()) {
    return HeldVertices{{said.vertices().indices().begin(), said.vertices().indices().end()}};
  }
  if (said.has_plane()) {
    return HeldPlane{ToPoint(said.plane().point_m()), ToPoint(said.plane().normal())};
  }
  if (said.has_box()) return HeldBox{ToPoint(said.box().low_m()), ToPoint(said.box().high_m())};
  return HeldGroup{said.group()};
}

v1::Fixture ToProto(const Fixture& fixture) {
  v1::Fixture said;
  std::visit(Writer{said}, fixture);
  return said;
}

}  // namespace carillon::precompute
