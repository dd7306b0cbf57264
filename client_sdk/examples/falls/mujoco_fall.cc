// SPDX-License-Identifier: Apache-2.0
#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client_sdk/adapters/mujoco_contacts.h"
#include "client_sdk/examples/falls/fall.h"
#include "proto/cpp/status_macros.h"

namespace carillon::falls {
namespace {

std::string Text(std::span<const double> values) { return absl::StrJoin(values, " "); }

bool IsPlane(const Body& body) { return std::holds_alternative<Plane>(body.shape); }

/// MuJoCo's contacts are springs and dampers. The ratio of damping at which a body leaves with the
/// part `restitution` of its speed follows from e = exp(-pi z / sqrt(1 - z^2)).
double DampingRatio(double restitution) {
  if (restitution <= 0) return 1;
  const double logarithm = -std::log(restitution);
  return logarithm / std::hypot(std::numbers::pi, logarithm);
}

/// MuJoCo leaves out contacts that do not fit into its buffers. A part is a ball, a box or a hull;
/// each can lie on the ground and on others with a few contacts each. A contact with friction has
/// a row along the normal and two across it.
constexpr size_t kContactsPerPart = 24, kRowsPerContact = 3;

size_t PartCount(const FallScene& scene) {
  size_t count = 0;
  for (const Body& body : scene.bodies) {
    const auto* boxes = std::get_if<std::vector<Box>>(&body.shape);
    count += boxes != nullptr ? boxes->size() : 1;
  }
  return count;
}

/// MuJoCo warns of contacts that it has left out, and of an unstable simulation, which it begins
/// anew: neither is to be heard. It would write its warnings into MUJOCO_LOG.TXT in the current
/// folder.
void EndWithWarning(const char* message) {
  absl::FPrintF(stderr, "carillon-fall: MuJoCo: %s; take more steps a second\n", message);
  std::exit(1);
}

class Mjcf {
 public:
  Mjcf(const FallScene& scene, double step_s) {
    // The engine's manual: not stiffer than two steps.
    constexpr double kSoftness_s = 0.005;
    const size_t contact_count = kContactsPerPart * PartCount(scene);
    absl::StrAppend(&text_, "<mujoco><size nconmax='", contact_count, "' njmax='",
                    kRowsPerContact * contact_count, "'/><option timestep='", step_s, "' gravity='",
                    Text(scene.gravity_m_per_s2),
                    "' cone='elliptic' impratio='10'/><default><geom friction='", scene.friction,
                    " 0 0' solref='", std::max(kSoftness_s, 2 * step_s), " ",
                    DampingRatio(scene.restitution), "'/></default>");
    std::string bodies;
    for (const Body& body : scene.bodies) bodies += BodyText(body);
    absl::StrAppend(&text_, "<asset>", meshes_, "</asset><worldbody>", bodies,
                    "</worldbody></mujoco>");
  }

  const std::string& text() const { return text_; }

 private:
  /// MuJoCo finds the contacts of a plane twice where it belongs to a body.
  std::string BodyText(const Body& body) {
    if (IsPlane(body)) {
      return absl::StrCat("<geom type='plane' size='10 10 1' pos='", Text(body.position_m), "'/>");
    }
    std::string text = absl::StrCat("<body pos='", Text(body.position_m), "' quat='",
                                    Text(body.orientation), "'>");
    if (body.mass_kg > 0) {
      absl::StrAppend(&text, "<freejoint/><inertial pos='0 0 0' mass='", body.mass_kg,
                      "' diaginertia='", Text(body.inertia_kg_m2), "'/>");
    }
    std::visit([&](const auto& shape) { text += GeomText(shape); }, body.shape);
    return text + "</body>";
  }

  static std::string GeomText(const Plane&) { return ""; }
  static std::string GeomText(const Ball& ball) {
    return absl::StrCat("<geom type='sphere' size='", ball.radius_m, "'/>");
  }
  static std::string GeomText(const std::vector<Box>& boxes) {
    std::string text;
    for (const Box& box : boxes) {
      Vector half = box.sides_m;
      for (double& side : half) side /= 2;
      absl::StrAppend(&text, "<geom type='box' size='", Text(half), "' pos='", Text(box.position_m),
                      "' quat='", Text(box.orientation), "'/>");
    }
    return text;
  }
  std::string GeomText(const Hull& hull) {
    const std::string name = absl::StrCat("hull", ++hull_count_);
    absl::StrAppend(&meshes_, "<mesh name='", name, "' vertex='");
    for (const Vector& corner : hull.corners_m) absl::StrAppend(&meshes_, Text(corner), " ");
    absl::StrAppend(&meshes_, "'/>");
    return absl::StrCat("<geom type='mesh' mesh='", name, "'/>");
  }

  std::string text_, meshes_;
  int hull_count_ = 0;
};

struct Delete {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
};

using Model = std::unique_ptr<mjModel, Delete>;

absl::StatusOr<Model> Compile(const std::string& xml) {
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), "fall.xml", static_cast<int>(xml.size()));
  std::memcpy(files->filedata[0], xml.data(), xml.size());
  std::array<char, 1000> error{};
  Model model(mj_loadXML("fall.xml", files.get(), error.data(), static_cast<int>(error.size())));
  mj_deleteVFS(files.get());
  if (!model) return absl::InvalidArgumentError(absl::StrCat("MuJoCo: ", error.data()));
  return model;
}

class MujocoFall {
 public:
  MujocoFall(const FallScene& scene, Model model)
      : model_(std::move(model)),
        data_(mj_makeData(model_.get())),
        contacts_({.roughness_depth = scene.roughness_depth,
                   .irregularity_length_m = scene.irregularity_length_m},
                  *model_) {
    int number = 0;  // MuJoCo's number of the body; the world's is 0
    uint32_t handle = 0;
    for (const Body& body : scene.bodies) {
      ++handle;
      if (IsPlane(body)) continue;
      ++number;
      if (!body.model.empty()) contacts_.AddObject(number, handle);
      if (body.mass_kg > 0) Push(number, body);
    }
  }

  v1::ContactStep Step() {
    v1::ContactStep step;
    step.set_time_s(static_cast<double>(++step_count_) * model_->opt.timestep);
    mj_step(model_.get(), data_.get());
    contacts_.Read(*data_, step);
    contacts_.ReadPoses(*data_, step);
    return step;
  }

 private:
  /// MuJoCo turns a free body about the axes of its own frame.
  void Push(int number, const Body& body) {
    mjtNum* velocity = data_->qvel + model_->body_dofadr[number];
    std::array<mjtNum, 4> inverse{};
    mju_negQuat(inverse.data(), body.orientation.data());
    mju_copy3(velocity, body.velocity_m_per_s.data());
    mju_rotVecQuat(velocity + 3, body.angular_velocity_rad_per_s.data(), inverse.data());
  }

  Model model_;
  std::unique_ptr<mjData, Delete> data_;
  adapters::MujocoContacts contacts_;
  int step_count_ = 0;
};

}  // namespace

absl::StatusOr<Simulation> FallInMujoco(const FallScene& scene, double step_s) {
  mju_user_warning = &EndWithWarning;
  ASSIGN_OR_RETURN(Model model, Compile(Mjcf(scene, step_s).text()));
  const auto fall = std::make_shared<MujocoFall>(scene, std::move(model));
  return [fall] { return fall->Step(); };
}

}  // namespace carillon::falls
