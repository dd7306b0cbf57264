// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mujoco/mujoco.h>

#include <cstdint>

#include "carillon/v1/contact.pb.h"
#include "client_sdk/adapters/contact_rows.h"

namespace carillon::adapters {

/// Reads the contacts of a MuJoCo model as the engine reports them, with the speed at which each
/// travels over the surfaces. MuJoCo's contacts are soft and spread a blow over several steps; the
/// daemon gathers these.
class MujocoContacts {
 public:
  /// `model` must outlive the adapter.
  MujocoContacts(const ContactSettings& settings, const mjModel& model)
      : rows_(settings), model_(model) {}

  /// Lets the body with the number `body`, 1 or more, sound as the object `handle` of the scene
  /// from now on. The frame of the body must be that of its modal model.
  void AddObject(int body, uint32_t handle) { rows_.AddObject(KeyOf(body), handle); }

  /// Lets the body sound no more.
  void RemoveObject(int body) { rows_.RemoveObject(KeyOf(body)); }

  /// Appends the contacts of the step that mj_step has just computed.
  void Read(const mjData& data, v1::ContactStep& step);

  /// Appends the poses that the objects had when the step began, as mj_step leaves them.
  void ReadPoses(const mjData& data, v1::ContactStep& step) const;

 private:
  /// Bodies are known by their masses' addresses; the fixed world is null.
  const void* KeyOf(int body) const { return body == 0 ? nullptr : model_.body_mass + body; }
  int BodyOf(const void* key) const {
    return static_cast<int>(static_cast<const mjtNum*>(key) - model_.body_mass);
  }
  ContactSide SideOf(const mjData& data, int geom, const mjContact& contact) const;

  ContactRows rows_;
  const mjModel& model_;
};

}  // namespace carillon::adapters
