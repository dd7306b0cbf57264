// SPDX-License-Identifier: Apache-2.0
'use strict';

const { ContactRows, collisionImpulse, reducedMassKg, slipAt, times } = require('./contact_rows');

/**
 * Contacts of an engine that tells which bodies met, and their velocities, but no impulses: they follow from masses and
 * restitution.
 */
class VelocityContacts {
  constructor(settings = {}) {
    this.contactRows = new ContactRows(settings);
  }

  addObject(key, handle) {
    this.contactRows.addObject(key, handle);
  }

  removeObject(key) {
    this.contactRows.removeObject(key);
  }

  /**
   * Returns the contacts of a step. Each collision is { first, second, point, normal, restitution, friction }: bodies as
   * ContactRows describes them, with their velocities before the collision, and a normal of unit length that points from
   * the second to the first. Report a collision in the step in which the bodies meet, and not again while they touch.
   */
  contacts(collisions) {
    return collisions.flatMap((collision) => {
      const along = collisionImpulse(collision);
      if (!along) return [];
      const across = frictionImpulse(collision, along);
      const impulse = times(collision.normal, along).map((x, i) => x + across[i]);
      return this.contactRows.rows({ ...collision, impulse });
    });
  }

  /** Poses of the objects, from a function that returns [position, orientation] of a body. */
  poses(poseOf) {
    return this.contactRows.poses(poseOf);
  }
}

/** Coulomb's friction on the first body: against the slip, and no greater than what stops it. */
function frictionImpulse(collision, along) {
  const slip = slipAt(collision);
  const speed = Math.hypot(...slip);
  const most = Math.min((collision.friction ?? 0) * along, speed * reducedMassKg(collision.first, collision.second));
  return speed > 0 ? times(slip, -most / speed) : [0, 0, 0];
}

module.exports = { VelocityContacts };
