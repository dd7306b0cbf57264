// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ode/ode.h>

#include <cstddef>
#include <functional>

#include "carillon/v1/contact.pb.h"
#include "client_sdk/adapters/ode_contacts.h"

namespace carillon::examples {

/// The way in which two bodies touch.
struct OdeSurface {
  double friction = 0;
  double restitution = 0;
  double slowest_bounce_m_per_s = 0.05;  ///< a slower contact does not bounce
};

/// Returns the surface of a contact between two bodies. A body that is null is the ground.
using OdeSurfaceOf = std::function<OdeSurface(dBodyID, dBodyID)>;

/// A world of ODE, whose gravity is 0, with one space for all geometries, and its contacts as
/// Carillon takes them.
class OdeWorld {
 public:
  OdeWorld(double step_s, const adapters::ContactSettings& settings, OdeSurfaceOf surface_of);
  ~OdeWorld();
  OdeWorld(const OdeWorld&) = delete;
  OdeWorld& operator=(const OdeWorld&) = delete;

  dWorldID world() const noexcept { return world_; }
  dSpaceID space() const noexcept { return space_; }
  adapters::OdeContacts& contacts() noexcept { return contacts_; }

  /// Softens all contacts as far as the manual of ODE advises for bodies that rest on one another.
  void SoftenContacts();

  /// Advances the world by one step. Returns its contacts, in a step of this time.
  v1::ContactStep Step(double time_s);

 private:
  static void Near(void* data, dGeomID a, dGeomID b);
  void Join(dGeomID a, dGeomID b, const dContactGeom& geometry);

  const double step_s_;
  const OdeSurfaceOf surface_of_;
  const dWorldID world_;
  const dSpaceID space_;
  const dJointGroupID joints_;  ///< the contacts of the step
  adapters::OdeContacts contacts_;
};

}  // namespace carillon::examples
