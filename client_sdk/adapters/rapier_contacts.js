// SPDX-License-Identifier: Apache-2.0
'use strict';

const { ContactRows, times, withFriction } = require('./contact_rows');

const vector = ({ x, y, z }) => [x, y, z];

/**
 * Reads the contacts of a Rapier world. Open the stream or trace with frame 'scene'. Rapier's impulses of friction have
 * no direction, so that friction is read out of the momentum of the bodies.
 */
class RapierContacts {
  constructor(settings = {}) {
    this.contactRows = new ContactRows(settings);
    this.bodies = new Map();
    this.before = new Map(); // Bodies as they were after the step before.
  }

  /** Lets a RigidBody sound as the object with this handle; its frame must be that of its modal model. */
  addObject(body, handle) {
    this.contactRows.addObject(body.handle, handle);
    this.bodies.set(body.handle, body);
    this.before.set(body.handle, describe(body));
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
    const { x, y, z } = world.gravity;
    const rows = withFriction(contacts, this.before, [x, y, z], world.timestep)
      .flatMap((contact) => this.contactRows.rows(contact));
    for (const [key, body] of this.bodies) this.before.set(key, describe(body));
    return { contacts: rows, poses: this.contactRows.poses((key) => this.poseOf(this.bodies.get(key))) };
  }

  /**
   * Rapier's normal points from the first collider to the second. Where both have moved on, each has a point of its
   * own.
   */
  readManifold(manifold, collider, other) {
    const [first, second] = [describe(collider.parent()), describe(other.parent())];
    const normal = times(vector(manifold.normal()), -1);
    const contacts = [];
    for (let i = 0; i < manifold.numContacts(); i += 1) {
      const along = manifold.contactImpulse(i);
      if (!(along > 0)) continue;
      const point = worldPoint(collider, manifold.localContactPoint1(i));
      const pointOnSecond = worldPoint(other, manifold.localContactPoint2(i));
      contacts.push({ first, second, point, pointOnSecond, normal, along, friction: manifold.friction() });
    }
    return contacts;
  }

  poseOf(body) {
    const { w, x, y, z } = body.rotation();
    return [vector(body.translation()), [w, x, y, z]];
  }
}

function describe(body) {
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
