// SPDX-License-Identifier: Apache-2.0
'use strict';

const { ContactRows, withFriction } = require('./contact_rows');

const vector = ({ x, y, z }) => [x, y, z];

/**
 * Reads the contacts of a PhysX scene (npm physx-js-webidl). Open the stream or trace with frame 'scene'. PhysX reports
 * the impulses along the normals, so that friction is read out of the momentum of the bodies. `settings` has
 * `friction`, the greatest coefficient of the scene, beside what ContactRows takes.
 */
class PhysxContacts {
  /** `physx` is the module. Give `callback` to the scene's description as its simulationEventCallback. */
  constructor(physx, settings = {}) {
    this.physx = physx;
    const { friction = Infinity, ...rest } = settings;
    this.friction = friction;
    this.contactRows = new ContactRows(rest);
    this.bodies = new Map();
    this.before = new Map(); // Bodies as they were after the step before.
    this.posesBefore = new Map();
    this.touches = [];
    this.buffer = new physx.PxArray_PxContactPairPoint(64);
    this.callback = new physx.PxSimulationEventCallbackImpl();
    this.callback.onContact = (header, pairs, count) => this.note(header, pairs, count);
    for (const other of ['onConstraintBreak', 'onWake', 'onSleep', 'onTrigger']) this.callback[other] = () => {};
  }

  /**
   * The flags of pairs by which PhysX reports contacts: word2 of the PxFilterData of each shape that sounds, as
   * DefaultFilterShader reads it. Another shader sets them itself.
   */
  static pairFlags({ PxPairFlagEnum }) {
    return PxPairFlagEnum.eNOTIFY_TOUCH_FOUND | PxPairFlagEnum.eNOTIFY_TOUCH_PERSISTS
      | PxPairFlagEnum.eNOTIFY_CONTACT_POINTS;
  }

  /** Lets a PxRigidBody sound as the object with this handle; its frame must be that of its modal model. */
  addObject(body, handle) {
    const key = this.keyOf(body);
    this.contactRows.addObject(key, handle);
    this.bodies.set(key, body);
    this.before.set(key, describe(body, key));
    this.posesBefore.set(key, poseOf(body));
  }

  /** Lets a body sound no more. Call it before the body's release(). */
  removeObject(body) {
    const key = this.keyOf(body);
    this.contactRows.removeObject(key);
    this.bodies.delete(key);
    this.before.delete(key);
    this.posesBefore.delete(key);
  }

  keyOf(actor) {
    return this.physx.getPointer(actor);
  }

  /** Keeps the contacts of two actors. PhysX calls it in fetchResults, with the addresses of its objects. */
  note(headerAt, pairsAt, count) {
    const { physx } = this;
    const header = physx.wrapPointer(headerAt, physx.PxContactPairHeader);
    const actors = [0, 1].map((side) => this.keyOf(header.get_actors(side)));
    if (!actors.some((key) => this.bodies.has(key))) return;
    for (let i = 0; i < count; i += 1) {
      const first = physx.wrapPointer(pairsAt, physx.PxContactPair);
      const pair = physx.NativeArrayHelpers.prototype.getContactPairAt(first, i);
      const found = pair.extractContacts(this.buffer.begin(), this.buffer.size());
      for (let k = 0; k < found; k += 1) {
        const { position, normal, impulse } = this.buffer.get(k);
        const along = Math.hypot(impulse.x, impulse.y, impulse.z);
        if (along > 0) this.touches.push({ actors, point: vector(position), normal: vector(normal), along });
      }
    }
  }

  /**
   * Returns what a step of a stream or trace takes. Call it after fetchResults(true) of a simulate(stepS). `gravity` is
   * the scene's, as an array. The poses are those from before the step, to which PhysX's points belong.
   */
  read(stepS, gravity) {
    const now = new Map();
    for (const [key, body] of this.bodies) now.set(key, describe(body, key));
    const of = (key) => now.get(key) ?? { key };
    // PhysX's normal points to the first actor.
    const contacts = this.touches.map(({ actors: [first, second], point, normal, along }) => (
      { first: of(first), second: of(second), point, normal, along, friction: this.friction }));
    this.touches = [];
    const rows = withFriction(contacts, this.before, gravity, stepS)
      .flatMap((contact) => this.contactRows.rows(contact));
    const poses = this.contactRows.poses((key) => this.posesBefore.get(key));
    this.before = now;
    for (const [key, body] of this.bodies) this.posesBefore.set(key, poseOf(body));
    return { contacts: rows, poses };
  }
}

function poseOf(body) {
  const { p, q } = body.getGlobalPose();
  return [vector(p), [q.w, q.x, q.y, q.z]];
}

function describe(body, key) {
  const { p, q } = body.getGlobalPose();
  const { x, y, z } = body.getCMassLocalPose().p;
  const [tx, ty, tz] = [2 * (q.y * z - q.z * y), 2 * (q.z * x - q.x * z), 2 * (q.x * y - q.y * x)];
  const centre = [p.x + x + q.w * tx + q.y * tz - q.z * ty, p.y + y + q.w * ty + q.z * tx - q.x * tz,
    p.z + z + q.w * tz + q.x * ty - q.y * tx];
  return { key, massKg: body.getMass(), centre, velocity: vector(body.getLinearVelocity()),
    angularVelocity: vector(body.getAngularVelocity()) };
}

module.exports = { PhysxContacts };
