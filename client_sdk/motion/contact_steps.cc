// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/contact_steps.h"

#include <utility>

namespace carillon::motion {
namespace {

/// A striker of this mass changes the reduced mass of no real body, and one of this radius is flat.
constexpr double kImmovableMassKg = 1e6, kFlatRadiusM = 1;

void Set(v1::Vec3& to, const Vector& from) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

void Set(v1::Quaternion& to, const Turn& from) {
  to.set_w(from.w());
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

/// One side of a contact.
struct Side {
  uint32_t body = 0;
  Vector point_m;
  Turn orientation;
};

class StepMaker {
 public:
  StepMaker(const Motion& motion, const StepSettings& settings)
      : motion_(motion), settings_(settings), steps_(motion.frame_count()) {
    for (size_t k = 0; k < steps_.size(); ++k) {
      steps_[k].set_time_s(motion.first_time_s + static_cast<double>(k) * motion.frame_s);
      AddPoses(k);
    }
  }

  void Add(const FoundBlow& blow) {
    Vector impulse;
    v1::Contact* row = AddContact(blow.frame, {blow.a, blow.point_a_m, blow.orientation_a},
                                  {blow.b, blow.point_b_m, blow.orientation_b},
                                  blow.impulse_newton_seconds, impulse);
    if (row == nullptr) return;
    row->set_kind(v1::CONTACT_KIND_IMPACT);
    row->set_time_offset_s(blow.time_s);
    Set(*row->mutable_impulse_newton_seconds(), impulse);
    const bool swapped = row->object() != settings_.handles[blow.a];
    Set(*row->mutable_normal(),
        (swapped ? blow.orientation_b : blow.orientation_a).conjugate() * blow.normal);
    if (blow.approach_m_per_s > 0) {
      row->mutable_hertz()->set_approach_speed_m_per_s(blow.approach_m_per_s);
    }
  }

  void Add(const FoundLoad& load) {
    Vector force;
    v1::Contact* row =
        AddContact(load.frame, {load.a, load.point_a_m, PoseOf(load.a, load.frame).orientation},
                   {load.b, load.point_b_m, PoseOf(load.b, load.frame).orientation},
                   load.force_newtons, force);
    if (row == nullptr) return;
    row->set_kind(v1::CONTACT_KIND_FORCE);
    row->clear_hertz();
    Set(*row->mutable_force_newtons(), force);
    row->mutable_roughness()->set_travel_speed_m_per_s(load.slip_m_per_s);
    row->mutable_roughness()->set_depth(settings_.roughness_depth);
    row->mutable_roughness()->set_irregularity_length_m(settings_.irregularity_length_m);
  }

  std::vector<v1::ContactStep> Take() { return std::move(steps_); }

 private:
  const BodyPose& PoseOf(size_t body, size_t frame) const {
    const std::vector<BodyPose>& poses = motion_.bodies[body].poses;
    return poses[poses.size() > 1 ? frame : 0];
  }

  void AddPoses(size_t frame) {
    v1::PoseColumns& poses = *steps_[frame].mutable_poses();
    for (size_t body = 0; body < settings_.handles.size(); ++body) {
      if (settings_.handles[body] == 0) continue;
      if (frame > 0 && motion_.bodies[body].poses.size() == 1) continue;
      const BodyPose& pose = PoseOf(body, frame);
      poses.add_object(settings_.handles[body]);
      for (const double x : pose.position_m) poses.add_position_m(x);
      const Turn& q = pose.orientation;
      for (const double x : {q.w(), q.x(), q.y(), q.z()}) {
        poses.add_orientation(static_cast<float>(x));
      }
    }
  }

  /// Returns null if neither body sounds. `own` becomes the vector on the object in its own frame.
  v1::Contact* AddContact(size_t frame, Side first, Side second, Vector on_first, Vector& own) {
    if (settings_.handles[first.body] == 0) {
      std::swap(first, second);
      on_first = -on_first;
    }
    if (settings_.handles[first.body] == 0) return nullptr;
    own = first.orientation.conjugate() * on_first;
    v1::Contact* row = steps_[frame].add_contacts();
    row->set_object(settings_.handles[first.body]);
    Set(*row->mutable_point_m(), first.point_m);
    if (settings_.handles[second.body] == 0) {
      const double mass_kg = motion_.bodies[second.body].mass_kg;
      row->mutable_hertz()->set_striker(settings_.strikers[second.body]);
      row->mutable_hertz()->set_striker_mass_kg(mass_kg > 0 ? mass_kg : kImmovableMassKg);
      if (!(mass_kg > 0)) row->mutable_hertz()->set_striker_radius_m(kFlatRadiusM);
      return row;
    }
    row->mutable_second()->set_object(settings_.handles[second.body]);
    Set(*row->mutable_second()->mutable_point_m(), second.point_m);
    Set(*row->mutable_second()->mutable_rotation(),
        second.orientation.conjugate() * first.orientation);
    return row;
  }

  const Motion& motion_;
  const StepSettings& settings_;
  std::vector<v1::ContactStep> steps_;
};

}  // namespace

std::vector<v1::ContactStep> ToSteps(const Motion& motion, const FoundContacts& found,
                                     const StepSettings& settings) {
  StepMaker maker(motion, settings);
  for (const FoundBlow& blow : found.blows) maker.Add(blow);
  for (const FoundLoad& load : found.loads) maker.Add(load);
  return maker.Take();
}

}  // namespace carillon::motion
