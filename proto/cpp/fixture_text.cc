// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/fixture_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <set>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

constexpr size_t kMaxGroupBytes = 200;

absl::Status Invalid(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS", what);
}

absl::Status NotAFixture(absl::string_view text) {
  return Invalid(
      absl::StrCat("\"", text.substr(0, 100),
                   "\" does not say which part of the body is fixed; give plane:X,Y,Z/NX,NY,NZ, "
                   "box:X,Y,Z/X,Y,Z, vertices:I,J,... or group:NAME"));
}

bool ToVector(absl::string_view text, v1::Vec3& vector) {
  const std::vector<absl::string_view> words = absl::StrSplit(text, ',');
  std::array<double, 3> x{};
  if (words.size() != x.size()) return false;
  for (size_t i = 0; i < x.size(); ++i) {
    if (!absl::SimpleAtod(words[i], &x[i])) return false;
  }
  vector.set_x(x[0]);
  vector.set_y(x[1]);
  vector.set_z(x[2]);
  return true;
}

bool ToTwoVectors(absl::string_view text, v1::Vec3& first, v1::Vec3& second) {
  const std::vector<absl::string_view> parts = absl::StrSplit(text, '/');
  return parts.size() == 2 && ToVector(parts[0], first) && ToVector(parts[1], second);
}

bool ToVertices(absl::string_view text, v1::FixedVertices& vertices) {
  for (const absl::string_view word : absl::StrSplit(text, ',')) {
    uint32_t index = 0;
    if (!absl::SimpleAtoi(word, &index)) return false;
    vertices.add_indices(index);
  }
  return true;
}

bool ToFixture(absl::string_view kind, absl::string_view rest, v1::Fixture& fixture) {
  if (kind == "plane") {
    v1::FixedPlane& plane = *fixture.mutable_plane();
    return ToTwoVectors(rest, *plane.mutable_point_m(), *plane.mutable_normal());
  }
  if (kind == "box") {
    v1::FixedBox& box = *fixture.mutable_box();
    return ToTwoVectors(rest, *box.mutable_low_m(), *box.mutable_high_m());
  }
  if (kind == "vertices") return ToVertices(rest, *fixture.mutable_vertices());
  if (kind == "group") fixture.set_group(std::string(rest));
  return kind == "group";
}

bool IsFinite(const v1::Vec3& v) {
  return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}

/// The shortest decimal that reads back as the same double; of a zero's two signs one.
std::string Shortest(double value) {
  std::array<char, 32> text;
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value + 0.0).ptr};
}

std::string Text(double x, double y, double z) {
  return absl::StrCat(Shortest(x), ",", Shortest(y), ",", Shortest(z));
}

absl::StatusOr<std::string> PlaneText(const v1::FixedPlane& plane) {
  const v1::Vec3& p = plane.point_m();
  const v1::Vec3& n = plane.normal();
  const double length = std::hypot(n.x(), n.y(), n.z());
  if (!IsFinite(p) || !std::isfinite(length) || !(length > 0)) {
    return Invalid("a fixed plane needs a finite point and a normal longer than zero");
  }
  return absl::StrCat("plane:", Text(p.x(), p.y(), p.z()), "/",
                      Text(n.x() / length, n.y() / length, n.z() / length));
}

absl::StatusOr<std::string> BoxText(const v1::FixedBox& box) {
  const v1::Vec3& a = box.low_m();
  const v1::Vec3& b = box.high_m();
  if (!IsFinite(a) || !IsFinite(b)) return Invalid("a fixed box needs finite corners");
  return absl::StrCat(
      "box:", Text(std::min(a.x(), b.x()), std::min(a.y(), b.y()), std::min(a.z(), b.z())), "/",
      Text(std::max(a.x(), b.x()), std::max(a.y(), b.y()), std::max(a.z(), b.z())));
}

absl::StatusOr<std::string> VerticesText(const v1::FixedVertices& vertices) {
  const std::set<uint32_t> indices(vertices.indices().begin(), vertices.indices().end());
  if (indices.empty() || indices.size() > static_cast<size_t>(kMaxFixedVertices)) {
    return Invalid(absl::StrCat(indices.size(), " vertices are to be fixed; name 1 to ",
                                kMaxFixedVertices, ", or a plane, a box or a group"));
  }
  return absl::StrCat("vertices:", absl::StrJoin(indices, ","));
}

absl::StatusOr<std::string> GroupText(const std::string& group) {
  const bool one_line = group.find_first_of(std::string("\n\r\0", 3)) == std::string::npos;
  if (group.empty() || group.size() > kMaxGroupBytes || !one_line) {
    return Invalid(absl::StrCat("a fixed group has a name of ", group.size(),
                                " bytes; it must have 1 to ", kMaxGroupBytes,
                                " and no line break"));
  }
  return absl::StrCat("group:", group);
}

}  // namespace

absl::StatusOr<v1::Fixture> ParseFixture(absl::string_view text) {
  const size_t colon = std::min(text.find(':'), text.size());
  v1::Fixture fixture;
  if (colon == text.size() || !ToFixture(text.substr(0, colon), text.substr(colon + 1), fixture)) {
    return NotAFixture(text);
  }
  if (const absl::StatusOr<std::string> said = FixtureText(fixture); !said.ok()) {
    return said.status();
  }
  return fixture;
}

absl::StatusOr<std::string> FixtureText(const v1::Fixture& fixture) {
  switch (fixture.region_case()) {
    case v1::Fixture::kVertices:
      return VerticesText(fixture.vertices());
    case v1::Fixture::kPlane:
      return PlaneText(fixture.plane());
    case v1::Fixture::kBox:
      return BoxText(fixture.box());
    case v1::Fixture::kGroup:
      return GroupText(fixture.group());
    case v1::Fixture::REGION_NOT_SET:
      break;
  }
  return Invalid("a fixture says nothing; name vertices, a plane, a box or a group");
}

}  // namespace carillon
