// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "carillon/v1/contact.pb.h"

namespace carillon::adapters {

using Vector = std::array<double, 3>;
using Quaternion = std::array<double, 4>;  ///< w, x, y, z

/// The properties of contacts that an engine does not know.
struct ContactSettings {
  double roughness_depth = 0.5;          ///< as in carillon.v1.Roughness
  double irregularity_length_m = 0.001;  ///< as in carillon.v1.Roughness
  /// The striker as which a body without a sound counts: a name of the catalogue, such as "wood".
  /// If it is empty, such a body counts as steel.
  std::string striker{};
  /// Duration of a blow, seconds. If it is absent, the daemon computes the duration of an elastic
  /// collision of the two bodies.
  std::optional<double> duration_s = std::nullopt;
};

/// One body of a contact; a body that is not dynamic stands still.
struct ContactSide {
  const void* body = nullptr;           ///< the engine's body; null for the fixed world
  Vector point_m{};                     ///< of the contact, in the frame of the body
  Quaternion orientation{1, 0, 0, 0};   ///< from the frame of the body to that of the world
  Vector velocity_m_per_s{};            ///< of the body's material at the contact, in the world
  Vector angular_velocity_rad_per_s{};  ///< in the world
  double lever_m = 0;  ///< from the contact to the centre of mass, along the normal
  /// Mass of a dynamic body; any other body does not move.
  std::optional<double> mass_kg = std::nullopt;
};

/// A contact of two bodies as an engine reports it for one step.
struct ContactReport {
  std::array<ContactSide, 2> sides;
  Vector normal{};                           ///< in the world, of unit length
  Vector impulse_on_first_newton_seconds{};  ///< over the step, friction included, in the world
};

/// Turns the contacts of an engine into the rows of a ContactStep. An adapter has one for the
/// engine's world, and fills in the reports.
class ContactRows {
 public:
  explicit ContactRows(const ContactSettings& settings) : settings_(settings) {}

  /// Lets `body` sound as the object `handle` of the scene from now on.
  void AddObject(const void* body, uint32_t handle) { handles_[body] = handle; }

  /// Lets `body` sound no more, and forgets its number as a partner, because another body may have
  /// its address later.
  void RemoveObject(const void* body);

  /// Appends a row for the contact unless neither body sounds. If both sound, the one with the
  /// lower handle is the object of the row and the other its second object, in whichever order the
  /// engine reports them.
  void Append(const ContactReport& contact, v1::ContactStep& step);

  /// Appends the pose of a body that sounds.
  void AppendPose(const void* body, const Vector& position_m, const Quaternion& orientation,
                  v1::ContactStep& step) const;

  /// The bodies that sound, and their handles.
  const std::map<const void*, uint32_t>& handles() const { return handles_; }

 private:
  uint32_t PartnerNumber(const void* body);
  /// Describes the body without a sound as a striker.
  void Describe(const ContactSide& silent, v1::HertzContact& hertz) const;

  ContactSettings settings_;
  std::map<const void*, uint32_t> handles_;
  std::map<const void*, uint32_t> partners_;  // a number for every body met
  uint32_t partner_count_ = 0;
};

}  // namespace carillon::adapters
