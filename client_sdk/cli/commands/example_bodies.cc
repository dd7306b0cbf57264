// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/example_bodies.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace carillon::cli {
namespace {

/// A point of a profile: the distance from the axis and the height, metres.
struct ProfilePoint {
  double radius_m;
  double height_m;
};

using Profile = std::vector<ProfilePoint>;

/// Adds points between the given ones on a Catmull-Rom spline, `pieces` for each span.
Profile Smooth(const Profile& points, int pieces) {
  const auto at = [&](size_t i) { return points[std::min(i, points.size() - 1)]; };
  const auto blend = [](double a, double b, double c, double d, double t) {
    return b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
  };
  Profile smooth;
  for (size_t i = 0; i + 1 < points.size(); ++i) {
    const ProfilePoint a = at(i == 0 ? 0 : i - 1), b = at(i), c = at(i + 1), d = at(i + 2);
    for (int piece = 0; piece < pieces; ++piece) {
      const double t = static_cast<double>(piece) / pieces;
      smooth.push_back({blend(a.radius_m, b.radius_m, c.radius_m, d.radius_m, t),
                        blend(a.height_m, b.height_m, c.height_m, d.height_m, t)});
    }
  }
  smooth.push_back(points.back());
  return smooth;
}

/// Turns a profile about the z axis. A closed profile makes a ring; the ends of an open one must
/// lie on the axis. The body is on the left of the way along the profile, seen with the axis upward
/// and the radius to the right.
ExampleBody Lathe(const Profile& profile, uint32_t around, bool closed) {
  ExampleBody body;
  // The first vertex of each ring. A point on the axis is a ring of one vertex.
  std::vector<uint32_t> first;
  for (const ProfilePoint& point : profile) {
    first.push_back(static_cast<uint32_t>(body.vertices.size()));
    const uint32_t count = point.radius_m > 0 ? around : 1;
    for (uint32_t i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * i / around;
      body.vertices.push_back(
          {point.radius_m * std::cos(angle), point.radius_m * std::sin(angle), point.height_m});
    }
  }
  const size_t spans = closed ? profile.size() : profile.size() - 1;
  for (size_t k = 0; k < spans; ++k) {
    const size_t next = (k + 1) % profile.size();
    const auto vertex = [&](size_t ring, uint32_t i) {
      return first[ring] + (profile[ring].radius_m > 0 ? i % around : 0);
    };
    for (uint32_t i = 0; i < around; ++i) {
      if (profile[k].radius_m > 0) {
        body.triangles.push_back({vertex(k, i), vertex(k, i + 1), vertex(next, i)});
      }
      if (profile[next].radius_m > 0) {
        body.triangles.push_back({vertex(k, i + 1), vertex(next, i + 1), vertex(next, i)});
      }
    }
  }
  return body;
}

/// Makes a vessel of two profiles: the first begins on the axis and ends at the rim, where the
/// second begins, which ends on the axis.
ExampleBody Vessel(Profile to_rim, const Profile& from_rim) {
  to_rim.insert(to_rim.end(), from_rim.begin(), from_rim.end());
  return Lathe(to_rim, 48, false);
}

ExampleBody DrawBell() {
  const Profile outside = {{0.0600, 0},     {0.0570, 0.010}, {0.0460, 0.030}, {0.0390, 0.055},
                           {0.0350, 0.080}, {0.0280, 0.095}, {0.0140, 0.102}, {0, 0.104}};
  const Profile inside = {{0, 0.0995},     {0.0130, 0.0975}, {0.0250, 0.0910}, {0.0312, 0.0785},
                          {0.0352, 0.055}, {0.0420, 0.030},  {0.0510, 0.010},  {0.0550, 0}};
  return Vessel(Smooth(inside, 3), Smooth(outside, 3));
}

/// Half a sphere about the origin that opens upward.
ExampleBody DrawBowl() {
  constexpr double kRadiusM = 0.08, kWallM = 0.004;
  constexpr int kRings = 16;
  Profile outside, inside;
  for (int ring = 0; ring <= kRings; ++ring) {
    const double angle = std::numbers::pi / 2 * ring / kRings;  // from the bottom to the rim
    const auto point = [&](double radius_m) {
      return ProfilePoint{ring == 0 ? 0 : radius_m * std::sin(angle), -radius_m * std::cos(angle)};
    };
    outside.push_back(point(kRadiusM));
    inside.insert(inside.begin(), point(kRadiusM - kWallM));
  }
  return Vessel(outside, inside);
}

ExampleBody DrawBar() {
  constexpr std::array<double, 3> kSizeM = {0.200, 0.030, 0.008};
  ExampleBody body;
  for (uint32_t corner = 0; corner < 8; ++corner) {
    body.vertices.push_back({(corner & 1U) != 0 ? kSizeM[0] : 0, (corner & 2U) != 0 ? kSizeM[1] : 0,
                             (corner & 4U) != 0 ? kSizeM[2] : 0});
  }
  body.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return body;
}

/// An aluminum tube of a wind chime, about the origin.
ExampleBody DrawChime() {
  constexpr double kLengthM = 0.4, kOuterM = 0.0125, kInnerM = 0.0115;
  constexpr int kAlong = 28;
  Profile profile;
  for (int i = 0; i <= kAlong; ++i) {
    profile.push_back({kOuterM, kLengthM * (static_cast<double>(i) / kAlong - 0.5)});
  }
  for (int i = kAlong; i >= 0; --i) {
    profile.push_back({kInnerM, kLengthM * (static_cast<double>(i) / kAlong - 0.5)});
  }
  return Lathe(profile, 32, true);
}

}  // namespace

const std::vector<Example>& Examples() {
  static const auto* const examples = new std::vector<Example>{
      {"bell", "a bronze bell, 12 cm wide", "bell_bronze", {0.06, 0, 0.005}, "-0.02,0,0", DrawBell},
      {"bowl",
       "a porcelain bowl, 16 cm wide",
       "porcelain",
       {0.08, 0, -0.005},
       "-0.01,0,0",
       DrawBowl},
      {"bar",
       "a bar of a xylophone, 20 cm long",
       "maple",
       {0.1, 0.015, 0.008},
       "0,0,-0.02",
       DrawBar},
      {"chime",
       "an aluminum tube of a wind chime, 40 cm long",
       "chime_aluminum",
       {0.0125, 0, 0},
       "-0.01,0,0",
       DrawChime}};
  return *examples;
}

ExampleFile WrittenExample(const Example& example, const std::vector<double>& size_m) {
  const ExampleBody body = example.draw();
  std::array<double, 3> scale = {1, 1, 1};
  for (size_t axis = 0; axis < size_m.size(); ++axis) {
    const auto [least, most] = std::ranges::minmax_element(
        body.vertices, {}, [axis](const std::array<double, 3>& vertex) { return vertex[axis]; });
    scale[axis] = size_m[axis] / ((*most)[axis] - (*least)[axis]);
  }
  std::string text = absl::StrCat("# ", example.description, "; coordinates are metres\n");
  for (const auto& [x, y, z] : body.vertices) {
    absl::StrAppendFormat(&text, "v %.9g %.9g %.9g\n", x * scale[0], y * scale[1], z * scale[2]);
  }
  for (const auto& [a, b, c] : body.triangles) {
    absl::StrAppend(&text, "f ", a + 1, " ", b + 1, " ", c + 1, "\n");
  }
  const auto& [x, y, z] = example.point_m;
  return {.obj = std::move(text),
          .strike = absl::StrFormat("--point %.9g,%.9g,%.9g --impulse %s", x * scale[0],
                                    y * scale[1], z * scale[2], example.impulse)};
}

}  // namespace carillon::cli
