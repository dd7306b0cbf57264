// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/fixture_codec.h"

#include "proto/cpp/fixture_text.h"

namespace carillon::precompute {
namespace {

Point ToPoint(const v1::Vec3& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

Fixture FromProto(const v1::Fixture& given) {
  // A fixture that FixtureText has no text for was refused before it came here.
  const v1::Fixture said = ParseFixture(FixtureText(given).value_or("")).value_or(given);
  if (said.has_vertices()) {
    return FixedVertices{{said.vertices().indices().begin(), said.vertices().indices().end()}};
  }
  if (said.has_plane()) {
    return FixedPlane{ToPoint(said.plane().point_m()), ToPoint(said.plane().normal())};
  }
  if (said.has_box()) return FixedBox{ToPoint(said.box().low_m()), ToPoint(said.box().high_m())};
  return FixedGroup{said.group()};
}

}  // namespace carillon::precompute
