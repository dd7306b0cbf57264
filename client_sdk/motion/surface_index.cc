// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/surface_index.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

namespace carillon::motion {
namespace {

using Edge = std::pair<uint32_t, uint32_t>;

/// An edge counts as sharp from this angle between its faces on.
const double kSharpCosine = std::cos(20 * std::numbers::pi / 180);
/// A vertex is a corner if each of its edges falls away from it by at least this angle, rad.
constexpr double kCornerFall = 0.003;

/// Barycentric weights of the point of a triangle that is nearest to `p` (C. Ericson, Real-Time
/// Collision Detection, 2005, section 5.1.5).
Vector NearestWeights(const Vector& p, const std::array<Vector, 3>& corner) {
  const auto& [a, b, c] = corner;
  const Vector ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp);
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - w, w};
  }
  const double sum = va + vb + vc;
  return {1 - (vb + vc) / sum, vb / sum, vc / sum};
}

Edge Sorted(uint32_t a, uint32_t b) { return {std::min(a, b), std::max(a, b)}; }

}  // namespace

/// Embree's objects, and what the callback reads. Normals are those of the faces, of the three
/// edges opposite to corners 0, 1, 2, and of the vertices (weighted by angle: J. Baerentzen and
/// H. Aanaes, Signed distance computation using the angle weighted pseudonormal, 2005).
struct SurfaceIndex::Tree {
  explicit Tree(const BodySurface& surface);
  ~Tree() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Tree(const Tree&) = delete;
  Tree& operator=(const Tree&) = delete;

  Vector NormalAt(uint32_t triangle, const Vector& weights) const;

  std::vector<Vector> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<Vector> face_normals, vertex_normals;
  std::vector<std::array<Vector, 3>> edge_normals;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

 private:
  void ComputeNormals();
  void Commit();
};

namespace {

struct Query {
  const std::vector<Vector>& vertices;
  const std::vector<std::array<uint32_t, 3>>& triangles;
  Vector point;
  double distance;
  int triangle = -1;
  Vector weights = Vector::Zero();
};

/// Embree calls this for each triangle that is near enough.
bool Visit(RTCPointQueryFunctionArguments* arguments) {
  Query& query = *static_cast<Query*>(arguments->userPtr);
  const auto& t = query.triangles[arguments->primID];
  const std::array<Vector, 3> corner = {query.vertices[t[0]], query.vertices[t[1]],
                                        query.vertices[t[2]]};
  const Vector w = NearestWeights(query.point, corner);
  const double distance =
      (query.point - w[0] * corner[0] - w[1] * corner[1] - w[2] * corner[2]).norm();
  if (distance >= query.distance) return false;
  query.distance = distance;
  query.triangle = static_cast<int>(arguments->primID);
  query.weights = w;
  arguments->query->radius = static_cast<float>(distance * 1.00001);
  return true;
}

}  // namespace

SurfaceIndex::Tree::Tree(const BodySurface& surface)
    : vertices(surface.vertices_m), triangles(surface.triangles) {
  ComputeNormals();
  Commit();
}

void SurfaceIndex::Tree::ComputeNormals() {
  vertex_normals.assign(vertices.size(), Vector::Zero());
  edge_normals.resize(triangles.size());
  std::map<Edge, Vector> of_edge;
  for (const auto& t : triangles) {
    const Vector normal =
        (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]).normalized();
    face_normals.push_back(normal);
    for (size_t i = 0; i < 3; ++i) {
      const Vector u = vertices[t[(i + 1) % 3]] - vertices[t[i]];
      const Vector v = vertices[t[(i + 2) % 3]] - vertices[t[i]];
      vertex_normals[t[i]] += std::atan2(u.cross(v).norm(), u.dot(v)) * normal;
      of_edge.try_emplace(Sorted(t[(i + 1) % 3], t[(i + 2) % 3]), Vector::Zero()).first->second +=
          normal;
    }
  }
  for (Vector& normal : vertex_normals) normal.normalize();
  for (size_t t = 0; t < triangles.size(); ++t) {
    for (size_t i = 0; i < 3; ++i) {
      edge_normals[t][i] =
          of_edge[Sorted(triangles[t][(i + 1) % 3], triangles[t][(i + 2) % 3])].normalized();
    }
  }
}

void SurfaceIndex::Tree::Commit() {
  device = rtcNewDevice("threads=1,user_threads=1");
  scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), vertices.size()));
  for (const Vector& vertex : vertices) {
    for (int axis = 0; axis < 3; ++axis) *points++ = static_cast<float>(vertex[axis]);
  }
  auto* indices = static_cast<uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(uint32_t), triangles.size()));
  for (const auto& triangle : triangles) indices = std::ranges::copy(triangle, indices).out;
  rtcSetGeometryPointQueryFunction(geometry, Visit);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
}

Vector SurfaceIndex::Tree::NormalAt(uint32_t triangle, const Vector& weights) const {
  constexpr double kOnEdge = 1e-9;
  int zeros = 0, zero = 0, one = 0;
  for (int i = 0; i < 3; ++i) {
    if (weights[i] <= kOnEdge)
      ++zeros, zero = i;
    else
      one = i;
  }
  if (zeros == 0) return face_normals[triangle];
  if (zeros == 1) return edge_normals[triangle][static_cast<size_t>(zero)];
  return vertex_normals[triangles[triangle][static_cast<size_t>(one)]];
}

SurfaceIndex::SurfaceIndex(const BodySurface& surface) : tree_(std::make_unique<Tree>(surface)) {
  for (const Vector& vertex : surface.vertices_m) box_.extend(vertex);
  FindEdges(surface);
  FindCorners(surface);
}

SurfaceIndex::~SurfaceIndex() = default;

void SurfaceIndex::FindCorners(const BodySurface& surface) {
  std::vector<bool> stands_out(surface.vertices_m.size(), true);
  std::vector<bool> used(surface.vertices_m.size(), false);
  const auto less = [](const Vector& one, const Vector& other) {
    return std::ranges::lexicographical_compare(one, other);
  };
  std::set<Vector, decltype(less)> ends(less);
  for (const SharpEdge& edge : edges_) ends.insert({edge.from_m, edge.to_m});
  for (const auto& t : surface.triangles) {
    for (size_t i = 0; i < 3; ++i) {
      used[t[i]] = true;
      for (const size_t j : {(i + 1) % 3, (i + 2) % 3}) {
        const Vector along = (surface.vertices_m[t[j]] - surface.vertices_m[t[i]]).normalized();
        if (along.dot(tree_->vertex_normals[t[i]]) > -kCornerFall) stands_out[t[i]] = false;
      }
    }
  }
  for (size_t i = 0; i < used.size(); ++i) {
    if (!used[i] || !stands_out[i]) continue;
    corners_.push_back(surface.vertices_m[i]);
    sharp_.push_back(ends.contains(surface.vertices_m[i]));
  }
}

void SurfaceIndex::FindEdges(const BodySurface& surface) {
  std::map<Edge, std::vector<std::pair<uint32_t, bool>>> faces;
  for (uint32_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& corner = surface.triangles[t];
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t a = corner[i], b = corner[(i + 1) % 3];
      faces[Sorted(a, b)].emplace_back(t, a < b);
    }
  }
  for (const auto& [edge, sides] : faces) {
    if (sides.size() != 2 || sides[0].second == sides[1].second) {
      closed_ = false;
      continue;
    }
    const uint32_t first = sides[0].second ? sides[0].first : sides[1].first;
    const uint32_t second = sides[0].second ? sides[1].first : sides[0].first;
    const Vector &n0 = tree_->face_normals[first], &n1 = tree_->face_normals[second];
    const Vector &from = surface.vertices_m[edge.first], &to = surface.vertices_m[edge.second];
    if (n0.dot(n1) > kSharpCosine || n0.cross(n1).dot(to - from) < 0) continue;
    const Vector mean = (n0 + n1).normalized();
    edges_.push_back({.from_m = from, .to_m = to, .normal = mean, .spread_cosine = mean.dot(n0)});
  }
}

std::optional<NearestPoint> SurfaceIndex::Nearest(const Vector& point, double radius_m) const {
  // A point that is exactly as far as the radius counts.
  Query query{.vertices = tree_->vertices,
              .triangles = tree_->triangles,
              .point = point,
              .distance = radius_m * (1 + 1e-9)};
  RTCPointQuery embree{.x = static_cast<float>(point.x()),
                       .y = static_cast<float>(point.y()),
                       .z = static_cast<float>(point.z()),
                       .time = 0,
                       // Room for the rounding of the point and of the vertices.
                       .radius = static_cast<float>(radius_m + 1e-6 * point.norm())};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(tree_->scene, &embree, &context, nullptr, &query);
  if (query.triangle < 0) return std::nullopt;
  const auto& t = tree_->triangles[static_cast<size_t>(query.triangle)];
  NearestPoint nearest;
  for (int i = 0; i < 3; ++i) {
    nearest.point_m += query.weights[i] * tree_->vertices[t[static_cast<size_t>(i)]];
  }
  nearest.normal = tree_->NormalAt(static_cast<uint32_t>(query.triangle), query.weights);
  nearest.gap_m =
      (point - nearest.point_m).dot(nearest.normal) < 0 ? -query.distance : query.distance;
  return nearest;
}

}  // namespace carillon::motion
