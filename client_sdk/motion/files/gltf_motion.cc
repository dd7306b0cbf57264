// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client_sdk/motion/files/gltf_physics.h"
#include "client_sdk/motion/files/motion_scene.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/gltf/gltf_document.h"
#include "proto/cpp/gltf/gltf_nodes.h"
#include "proto/cpp/gltf/gltf_surface.h"

namespace carillon::motion {
namespace {

using nlohmann::json;

/// A fault with a reason of its own, which ReadGltfMotion returns.
struct MotionFault {
  std::string reason, what;
};

/// How one property of a node changes.
struct Channel {
  std::vector<double> times, values;
  size_t width = 3;
  std::string interpolation = "LINEAR";

  /// The value at key `k`; a cubic spline has a tangent before and after each value.
  const double* Key(size_t k, size_t part = 1) const {
    const size_t index = interpolation == "CUBICSPLINE" ? 3 * k + part : k;
    return &values[index * width];
  }
  bool Changes() const {
    for (size_t k = 1; k < times.size(); ++k) {
      for (size_t i = 0; i < width; ++i) {
        if (std::abs(Key(k)[i] - Key(0)[i]) > 1e-7) return true;
      }
    }
    return false;
  }
  std::vector<double> At(double time) const;
};

std::vector<double> Slerp(const double* a, const double* b, double share) {
  const Turn from(a[3], a[0], a[1], a[2]), to(b[3], b[0], b[1], b[2]);
  const Turn at = from.normalized().slerp(share, to.normalized());
  return {at.x(), at.y(), at.z(), at.w()};
}

std::vector<double> Channel::At(double time) const {
  // A frame's time is that of a key but for its rounding, which would show the key before.
  const double early = interpolation == "STEP" ? 1e-4 : 0;
  const auto next = std::ranges::upper_bound(times, time + early);
  if (next == times.begin()) return {Key(0), Key(0) + width};
  const auto k = static_cast<size_t>(next - times.begin()) - 1;
  if (k + 1 == times.size() || interpolation == "STEP") return {Key(k), Key(k) + width};
  const double span = times[k + 1] - times[k], s = (time - times[k]) / span;
  if (interpolation == "LINEAR" && width == 4) return Slerp(Key(k), Key(k + 1), s);
  std::vector<double> value(width);
  for (size_t i = 0; i < width; ++i) {
    if (interpolation == "LINEAR") {
      value[i] = (1 - s) * Key(k)[i] + s * Key(k + 1)[i];
      continue;
    }
    // The spline of glTF 2.0, appendix C.
    const double s2 = s * s, s3 = s2 * s;
    value[i] = (2 * s3 - 3 * s2 + 1) * Key(k)[i] + span * (s3 - 2 * s2 + s) * Key(k, 2)[i] +
               (3 * s2 - 2 * s3) * Key(k + 1)[i] + span * (s3 - s2) * Key(k + 1, 0)[i];
  }
  return value;
}

struct NodeChannels {
  std::optional<Channel> translation, rotation, scale;
};

/// Splits a matrix into a place without scale. The scale of a mirrored node stays in its surface.
BodyPose PoseFrom(const GltfMatrix& m) {
  Matrix turn;
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) turn(row, column) = m[static_cast<size_t>(4 * column + row)];
    turn.col(column).normalize();
  }
  if (turn.determinant() < 0) turn.col(0) = -turn.col(0);
  return {{m[12], m[13], m[14]}, Turn(turn).normalized()};
}

Vector ScaleOf(const GltfMatrix& m) {
  Vector scale;
  for (size_t column = 0; column < 3; ++column) {
    scale[static_cast<Eigen::Index>(column)] =
        std::hypot(m[4 * column], m[4 * column + 1], m[4 * column + 2]);
  }
  return scale;
}

/// The scale and the shear of a matrix. The rounding of poses is taken out, so that a mesh is the
/// same body, whose model is stored, however it lies.
GltfMatrix InFrameOf(const BodyPose& pose, const GltfMatrix& m) {
  constexpr int kExactBits = 20;
  Matrix linear;
  for (int i = 0; i < 9; ++i) linear(i % 3, i / 3) = m[static_cast<size_t>(4 * (i / 3) + i % 3)];
  linear = pose.orientation.conjugate() * linear;
  const double unit = std::exp2(std::floor(std::log2(linear.cwiseAbs().maxCoeff())) - kExactBits);
  GltfMatrix own{};
  for (int i = 0; i < 9; ++i) {
    own[static_cast<size_t>(4 * (i / 3) + i % 3)] = std::round(linear(i % 3, i / 3) / unit) * unit;
  }
  own[15] = 1;
  return own;
}

std::string NameOf(const json& node, size_t index) {
  const json& name = Member(node, "name");
  return name.is_string() ? name.get<std::string>() : absl::StrCat("node ", index);
}

class MotionReader {
 public:
  MotionReader(const GltfDocument& document, bool even_if_coarse)
      : document_(document), nodes_(document), even_if_coarse_(even_if_coarse) {}

  MotionScene Read() {
    ReadChannels();
    SetFrames();
    for (size_t k = 0; k < frame_count_; ++k) worlds_.push_back(WorldsAt(TimeOf(k)));
    for (const size_t node : nodes_.Shown(document_)) {
      const json& json_node = document_.root()["nodes"][node];
      if (json_node.contains("mesh")) AddBody(node, json_node);
      if (json_node.contains("camera")) {
        scene_.listeners.push_back({NameOf(json_node, node), PosesOf(node)});
      }
    }
    const auto moves = [](const MovingBody& body) { return body.poses.size() > 1; };
    if (std::ranges::none_of(scene_.motion.bodies, moves)) {
      throw MotionFault{"NO_MOTION",
                        "no node with a mesh is animated: bake the simulation to "
                        "keys, and export the animation"};
    }
    return std::move(scene_);
  }

 private:
  void ReadChannels() {
    const json& animations = Member(document_.root(), "animations");
    for (const json& animation : animations.is_array() ? animations : json::array()) {
      for (const json& channel : animation.at("channels")) {
        const json& target = channel.at("target");
        const std::string path = target.value("path", "");
        if (!target.contains("node") || path == "weights") continue;
        const json& sampler = animation.at("samplers").at(channel.at("sampler").get<size_t>());
        Channel read;
        read.width = path == "rotation" ? 4 : 3;
        read.interpolation = sampler.value("interpolation", "LINEAR");
        read.times = document_.Read<double>(sampler.at("input"), "SCALAR");
        read.values =
            document_.Read<double>(sampler.at("output"), path == "rotation" ? "VEC4" : "VEC3");
        const size_t parts = read.interpolation == "CUBICSPLINE" ? 3 : 1;
        if (read.times.empty() || read.values.size() != parts * read.width * read.times.size()) {
          throw GltfFault("an animation has different numbers of keys and of values");
        }
        NodeChannels& node = channels_[document_.IndexIn("nodes", target["node"])];
        (path == "rotation" ? node.rotation
         : path == "scale"  ? node.scale
                            : node.translation) = std::move(read);
      }
    }
  }

  template <typename Visitor>
  void EachChanging(const Visitor& visit) const {
    for (const auto& [node, channels] : channels_) {
      for (const auto* channel : {&channels.translation, &channels.rotation, &channels.scale}) {
        if (*channel && (*channel)->Changes()) visit(node, **channel);
      }
    }
  }

  /// The frame is the median distance between two keys of one channel.
  void SetFrames() {
    std::vector<double> distances;
    double first = 1e300, last = -1e300;
    EachChanging([&](size_t, const Channel& channel) {
      first = std::min(first, channel.times.front());
      last = std::max(last, channel.times.back());
      for (size_t k = 1; k < channel.times.size(); ++k) {
        distances.push_back(channel.times[k] - channel.times[k - 1]);
      }
    });
    if (distances.empty()) {
      throw MotionFault{"NO_MOTION",
                        "the file has no animation of nodes: bake the simulation to "
                        "keys, and export the animation"};
    }
    std::ranges::nth_element(distances,
                             distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2));
    const double median = distances[distances.size() / 2];
    frame_count_ = static_cast<size_t>(std::lround((last - first) / median)) + 1;
    scene_.motion.first_time_s = first;
    scene_.motion.frame_s =
        frame_count_ > 1 ? (last - first) / static_cast<double>(frame_count_ - 1) : median;
    CheckKeys();
  }

  /// Keys that an exporter left out are lost to second differences.
  void CheckKeys() const {
    if (even_if_coarse_) return;
    EachChanging([&](size_t node, const Channel& channel) {
      for (size_t k = 1; k < channel.times.size(); ++k) {
        const double frames = (channel.times[k] - channel.times[k - 1]) / scene_.motion.frame_s;
        if (std::abs(frames - 1) < 0.1) continue;
        throw MotionFault{
            "MOTION_TOO_COARSE",
            absl::StrCat("the keys of ", NameOf(document_.root()["nodes"][node], node), " are ",
                         channel.times[k] - channel.times[k - 1], " s apart after ",
                         channel.times[k - 1], " s, and others ", scene_.motion.frame_s,
                         " s: export one key for each frame (in Blender: Sampling "
                         "Animations, without Optimize Animation Size)")};
      }
    });
  }

  double TimeOf(size_t frame) const {
    return scene_.motion.first_time_s + static_cast<double>(frame) * scene_.motion.frame_s;
  }

  std::vector<GltfMatrix> WorldsAt(double time) const {
    std::vector<GltfMatrix> locals = nodes_.locals();
    for (const auto& [index, channels] : channels_) {
      const json& node = document_.root()["nodes"][index];
      const auto at = [&](const std::optional<Channel>& channel, const char* key,
                          std::vector<double> usual) {
        if (channel) return channel->At(time);
        return node.contains(key) ? node[key].get<std::vector<double>>() : usual;
      };
      const std::vector<double> t = at(channels.translation, "translation", {0, 0, 0});
      const std::vector<double> r = at(channels.rotation, "rotation", {0, 0, 0, 1});
      const std::vector<double> s = at(channels.scale, "scale", {1, 1, 1});
      if (t.size() != 3 || r.size() != 4 || s.size() != 3) throw GltfFault("a node is malformed");
      locals[index] = MatrixOf({t[0], t[1], t[2]}, {r[0], r[1], r[2], r[3]}, {s[0], s[1], s[2]});
    }
    return nodes_.Worlds(locals);
  }

  /// One pose for each frame, or a single one if the node stays.
  std::vector<BodyPose> PosesOf(size_t node) const {
    std::vector<BodyPose> poses;
    bool moves = false;
    for (const auto& worlds : worlds_) {
      poses.push_back(PoseFrom(worlds[node]));
      moves = moves || (poses.back().position_m - poses[0].position_m).norm() > 1e-9 ||
              poses.back().orientation.angularDistance(poses[0].orientation) > 1e-9;
    }
    if (!moves) poses.resize(1);
    return poses;
  }

  void CheckRigid(size_t node, const json& json_node, const std::string& name) const {
    const json& mesh = document_.At("meshes", json_node["mesh"]);
    for (const json& primitive : Member(mesh, "primitives")) {
      if (!primitive.contains("targets")) continue;
      throw MotionFault{"MOTION_MALFORMED",
                        absl::StrCat(name,
                                     " has morph targets, and only rigid bodies have "
                                     "impulses: remove them, or the node")};
    }
    if (json_node.contains("skin")) {
      throw MotionFault{"MOTION_MALFORMED",
                        absl::StrCat(name,
                                     " has a skin, and only rigid bodies have impulses: bake "
                                     "it to an object that moves, or remove the node")};
    }
    const Vector scale = ScaleOf(worlds_[0][node]);
    for (const auto& worlds : worlds_) {
      if ((ScaleOf(worlds[node]) - scale).norm() < 1e-3 * scale.norm()) continue;
      throw MotionFault{"MOTION_MALFORMED", absl::StrCat("the scale of ", name,
                                                         " is animated, and a rigid body keeps "
                                                         "its size")};
    }
  }

  void AddBody(size_t node, const json& json_node) {
    const std::string name = NameOf(json_node, node);
    CheckRigid(node, json_node, name);
    MovingBody& body = scene_.motion.bodies.emplace_back();
    SceneBody& about = scene_.bodies.emplace_back();
    body.name = name;
    body.poses = PosesOf(node);
    std::vector<GltfMatrix> own = worlds_[0];
    own[node] = InFrameOf(body.poses[0], own[node]);
    for (const GltfSurface& surface : ReadPlacedMesh(document_, node, own)) {
      AddSurface(surface, body.surface);
    }
    if (body.surface.triangles.empty()) throw GltfFault(absl::StrCat(name, " has no triangle"));
    about.material = MaterialOf(json_node);
    ReadGltfPhysics(document_, json_node, worlds_[0][node], body, about);
  }

  std::string MaterialOf(const json& node) const {
    const json& mesh = document_.At("meshes", node["mesh"]);
    for (const json& primitive : Member(mesh, "primitives")) {
      if (!primitive.contains("material")) continue;
      const json& name = Member(document_.At("materials", primitive["material"]), "name");
      if (name.is_string()) return name.get<std::string>();
    }
    return "";
  }

  const GltfDocument& document_;
  GltfNodes nodes_;
  bool even_if_coarse_;
  std::map<size_t, NodeChannels> channels_;
  size_t frame_count_ = 0;
  std::vector<std::vector<GltfMatrix>> worlds_;  ///< of all nodes at each frame
  MotionScene scene_;
};

}  // namespace

absl::StatusOr<MotionScene> ReadGltfMotion(const std::string& path, bool even_if_coarse) {
  const std::optional<std::string> bytes = BytesOfFile(path);
  if (!bytes) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat(path, " cannot be read"));
  }
  try {
    const std::string folder = std::filesystem::path(path).parent_path().string();
    const GltfDocument document(*bytes, folder.empty() ? "." : folder);
    MotionScene scene = MotionReader(document, even_if_coarse).Read();
    scene.motion.gravity_m_per_s2 = {0, -9.81, 0};  // a glTF has metres, and y points up
    return scene;
  } catch (const MotionFault& fault) {
    return Refusal(absl::StatusCode::kInvalidArgument, fault.reason,
                   absl::StrCat(path, ": ", fault.what));
  } catch (const GltfFault& fault) {
    return GltfRefusal("MOTION_MALFORMED", fault);
  } catch (const json::exception& fault) {
    return GltfRefusal("MOTION_MALFORMED", fault);
  }
}

}  // namespace carillon::motion
