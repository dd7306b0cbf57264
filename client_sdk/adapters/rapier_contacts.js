// SPDX-License-Identifier: Apache-2.0
'use strict';

const { ContactRows, frictionImpulse, times } = require('./contact_rows');

const vector = ({ x, y, z }) => [x, y, z];

/**
 * Reads the contacts of a Rapier world. Open the stream or trace with frame 'scene'. Rapier's impulses of friction have
 * no direction, so that friction is taken to act against the slip.
 */
class RapierContacts {
  constructor(settings = {}) {
    this.contactRows = new ContactRows(settings);
  }

  /** Lets a RigidBody sound as the object with this handle; its frame must be that of its modal model. */
  addObject(body, handle) {
    this.contactRows.addObject(body.handle, handle);
    this.bodies = (this.bodies ?? new Map()).set(body.handle, body);
  }

  /** Returns what a step of a stream or trace takes. Call it after world.step(). */
  read(world) {
    const contacts = [];
    world.forEachCollider((collider) => world.contactPairsWith(collider, (other) => {
      if (collider.handle > other.handle) return; // Each pair is met from both sides.
      world.contactPair(collider, other, (manifold, flipped) => {
        contacts.push(...this.readManifold(manifold, ...(flipped ? [other, collider] : [collider, other])));
      });
    }));
    return { contacts, poses: this.contactRows.poses((key) => this.poseOf(this.bodies.get(key))) };
  }

  /** The normal points from the first collider to the second. */
  readManifold(manifold, collider, other) {
    const [first, second] = [bodyOf(collider), bodyOf(other)];
    const normal = times(vector(manifold.normal()), -1);
    const contacts = [];
    for (let i = 0; i < manifold.numContacts(); i += 1) {
      const along = manifold.contactImpulse(i);
      if (!(along > 0)) continue;
      const point = worldPoint(collider, manifold.localContactPoint1(i));
      const across = frictionImpulse({ first, second, point, normal }, along, manifold.friction());
      const impulse = times(normal, along).map((x, axis) => x + across[axis]);
      contacts.push(...this.contactRows.rows({ first, second, point, normal, impulse }));
    }
    return contacts;
  }

  poseOf(body) {
    const { w, x, y, z } = body.rotation();
    return [vector(body.translation()), [w, x, y, z]];
  }
}

function bodyOf(collider) {
  const body = collider.parent();
  if (!body || !body.isDynamic()) return { key: body ? body.handle : -1 };
  return { key: body.handle, massKg: body.mass(), centre: vector(body.worldCom()), velocity: vector(body.linvel()),
    angularVelocity: vector(body.angvel()) };
}

/** Rapier keeps points in the frame of the collider, which has moved on since they were found. */
function worldPoint(collider, { x, y, z }) {
  const q = collider.rotation();
  const [tx, ty, tz] = [2 * (q.y * z - q.z * y), 2 * (q.z * x - q.x * z), 2 * (q.x * y - q.y * x)];
  const at = collider.translation();
  return [at.x + x + q.w * tx + q.y * tz - q.z * ty, at.y + y + q.w * ty + q.z * tx - q.x * tz,
    at.z + z + q.w * tz + q.x * ty - q.y * tx];
}

module.exports = { RapierContacts };
