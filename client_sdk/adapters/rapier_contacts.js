// SPDX-License-Identifier: Apache-2.0
'use strict';

const { ContactRows, withFriction } = require('./contact_rows');

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

  /** Lets a RigidBody sound no more, before or after world.removeRigidBody(body). */
  removeObject(body) {
    this.forget(body.handle);
  }

  forget(key) {
    this.contactRows.removeObject(key);
    this.bodies.delete(key);
    this.before.delete(key);
  }

  /** Returns what a step of a stream or trace takes. Call it after world.step(). Removed bodies sound no more. */
  read(world) {
    // Rapier's world is lost if a body is asked that was removed.
    for (const [key, body] of this.bodies) if (world.getRigidBody(key) !== body) this.forget(key);
    const step = new Step(world, this.bodies);
    const { x, y, z } = world.gravity;
    const rows = withFriction(step.contacts(), this.before, [x, y, z], world.timestep)
      .flatMap((contact) => this.contactRows.rows(contact));
    for (const [key, body] of this.bodies) this.before.set(key, step.bodyOf(body));
    return { contacts: rows, poses: this.contactRows.poses((key) => poseOf(this.bodies.get(key))) };
  }
}

/** What is asked of the world after a step. A call into Rapier takes about a microsecond, so none is repeated. */
class Step {
  constructor(world, bodies) {
    this.world = world;
    this.sounding = bodies;
    this.described = new Map();
    this.places = new Map();
  }

  /** The contacts of the bodies that sound, with their impulse along the normal. */
  contacts() {
    const contacts = [];
    for (const body of this.sounding.values()) {
      for (let i = 0; i < body.numColliders(); i += 1) {
        const collider = body.collider(i);
        this.world.contactPairsWith(collider, (other) => {
          // A collider that was removed is in a pair until the next step.
          if (!other) return;
          const partner = other.parent();
          // A pair whose bodies both sound is met from both sides.
          if (partner && collider.handle > other.handle && this.sounding.has(partner.handle)) return;
          this.world.contactPair(collider, other, (manifold, flipped) => {
            if (flipped) this.readManifold(manifold, other, collider, contacts);
            else this.readManifold(manifold, collider, other, contacts);
          });
        });
      }
    }
    return contacts;
  }

  /**
   * Rapier's normal points from the first collider to the second. Where both have moved on, each has a point of its
   * own.
   */
  readManifold(manifold, collider, other, contacts) {
    const friction = manifold.friction();
    let [first, second, normal] = [];
    for (let i = 0; i < manifold.numContacts(); i += 1) {
      const along = manifold.contactImpulse(i);
      if (!(along > 0)) continue;
      if (!normal) {
        const { x, y, z } = manifold.normal();
        normal = [-x, -y, -z];
        first = this.bodyOf(collider.parent());
        second = this.bodyOf(other.parent());
      }
      const point = this.worldPoint(collider, manifold.localContactPoint1(i));
      const pointOnSecond = this.worldPoint(other, manifold.localContactPoint2(i));
      contacts.push({ first, second, point, pointOnSecond, normal, along, friction, impulse: undefined });
    }
  }

  bodyOf(body) {
    const key = body ? body.handle : -1;
    if (!this.described.has(key)) this.described.set(key, describe(body));
    return this.described.get(key);
  }

  /** Rapier keeps points in the frame of the collider, which has moved on since they were found. */
  worldPoint(collider, { x, y, z }) {
    if (!this.places.has(collider.handle)) {
      this.places.set(collider.handle, { q: collider.rotation(), at: collider.translation() });
    }
    const { q, at } = this.places.get(collider.handle);
    const tx = 2 * (q.y * z - q.z * y);
    const ty = 2 * (q.z * x - q.x * z);
    const tz = 2 * (q.x * y - q.y * x);
    return [at.x + x + q.w * tx + q.y * tz - q.z * ty, at.y + y + q.w * ty + q.z * tx - q.x * tz,
      at.z + z + q.w * tz + q.x * ty - q.y * tx];
  }
}

function poseOf(body) {
  const { w, x, y, z } = body.rotation();
  return [vector(body.translation()), [w, x, y, z]];
}

function describe(body) {
  if (!body || !body.isDynamic()) return { key: body ? body.handle : -1 };
  return { key: body.handle, massKg: body.mass(), centre: vector(body.worldCom()), velocity: vector(body.linvel()),
    angularVelocity: vector(body.angvel()) };
}

module.exports = { RapierContacts };
