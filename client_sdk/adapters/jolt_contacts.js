// SPDX-License-Identifier: Apache-2.0
'use strict';

const { ContactRows, minus, plus, times } = require('./contact_rows');
const { balanced } = require('./motion_balance');

const vector = (v) => [v.GetX(), v.GetY(), v.GetZ()];

/**
 * Reads the contacts of a Jolt world. Open the stream or trace with frame 'scene'. Jolt's listener tells where bodies
 * touch before it solves the step, and nobody how strongly, so that the impulses are those that change the velocities
 * of the bodies as the step did.
 */
class JoltContacts {
  /**
   * `jolt` is the module and `system` the PhysicsSystem, whose listener of contacts the adapter becomes. Another
   * listener can be called by the functions OnContactAdded and OnContactPersisted of `settings.listener`.
   */
  constructor(jolt, system, settings = {}) {
    const { listener: next, ...rest } = settings;
    this.jolt = jolt;
    this.system = system;
    this.contactRows = new ContactRows(rest);
    this.bodies = new Map();
    this.touches = [];
    this.listener = new jolt.ContactListenerJS();
    this.listener.OnContactValidate = (...all) => next?.OnContactValidate?.(...all)
      ?? jolt.ValidateResult_AcceptAllContactsForThisBodyPair;
    for (const event of ['OnContactAdded', 'OnContactPersisted']) {
      this.listener[event] = (...all) => {
        next?.[event]?.(...all); // which may change the friction
        this.note(...all);
      };
    }
    this.listener.OnContactRemoved = (pair) => next?.OnContactRemoved?.(pair);
    system.SetContactListener(this.listener);
  }

  /** Lets a Body sound as the object with this handle; its frame must be that of its modal model. */
  addObject(body, handle) {
    const key = keyOf(body);
    this.contactRows.addObject(key, handle);
    this.bodies.set(key, { body, before: this.describe(body), poseBefore: poseOf(body) });
  }

  /** Lets a Body sound no more. Call it before BodyInterface.DestroyBody. */
  removeObject(body) {
    const key = keyOf(body);
    this.contactRows.removeObject(key);
    this.bodies.delete(key);
    this.touches = this.touches.filter(({ first, second }) => first !== key && second !== key);
  }

  /** Notes where two bodies touch. Jolt calls it in the step, with the addresses of its objects. */
  note(one, other, manifold, contactSettings) {
    const { jolt } = this;
    const [first, second] = [jolt.wrapPointer(one, jolt.Body), jolt.wrapPointer(other, jolt.Body)];
    if (first.IsSensor() || second.IsSensor()) return;
    const touch = jolt.wrapPointer(manifold, jolt.ContactManifold);
    const { mCombinedFriction: friction } = jolt.wrapPointer(contactSettings, jolt.ContactSettings);
    // Jolt's normal points from the first body to the second.
    const normal = times(vector(touch.mWorldSpaceNormal), -1);
    for (let i = 0; i < touch.mRelativeContactPointsOn1.size(); i += 1) {
      this.touches.push({ first: keyOf(first), second: keyOf(second), normal, friction,
        bodies: [this.describe(first), this.describe(second)], point: vector(touch.GetWorldSpaceContactPointOn1(i)),
        pointOnSecond: vector(touch.GetWorldSpaceContactPointOn2(i)) });
    }
  }

  /**
   * Returns what a step of a stream or trace takes. Call it after each JoltInterface.Step(stepS, 1), whose collisions
   * are one step. The poses are those from before the step, to which Jolt's points belong.
   */
  read(stepS) {
    const gravity = vector(this.system.GetGravity());
    const now = new Map();
    for (const [key, { body, before }] of this.bodies) now.set(key, this.gained(body, before, gravity, stepS));
    const contacts = this.touches.map(({ bodies: [first, second], ...touch }) => (
      { ...touch, first: now.get(first.key) ?? first, second: now.get(second.key) ?? second }));
    this.touches = [];
    const rows = balanced(contacts).flatMap((contact) => this.contactRows.rows(contact));
    const poses = this.contactRows.poses((key) => this.bodies.get(key).poseBefore);
    for (const object of this.bodies.values()) {
      object.before = this.describe(object.body);
      object.poseBefore = poseOf(object.body);
    }
    return { contacts: rows, poses };
  }

  describe(body) {
    const key = keyOf(body);
    if (!body.IsDynamic()) return { key };
    return { key, massKg: 1 / body.GetMotionProperties().GetInverseMass(),
      centre: vector(body.GetCenterOfMassPosition()), velocity: vector(body.GetLinearVelocity()),
      angularVelocity: vector(body.GetAngularVelocity()) };
  }

  /** The body after the step, with what contacts have changed of its velocities. */
  gained(body, before, gravity, stepS) {
    const after = this.describe(body);
    if (!after.massKg || !before.massKg) return after;
    const motion = body.GetMotionProperties();
    const inverse = body.GetInverseInertia();
    const inverseInertia = [inverse.GetAxisX(), inverse.GetAxisY(), inverse.GetAxisZ()].map(vector);
    const free = times(plus(before.velocity, times(gravity, motion.GetGravityFactor() * stepS)),
      Math.max(0, 1 - motion.GetLinearDamping() * stepS));
    const freeTurn = times(before.angularVelocity, Math.max(0, 1 - motion.GetAngularDamping() * stepS));
    // Contacts turn the body about where its centre was in the step.
    return { ...after, centre: before.centre, inverseInertia, gained: minus(after.velocity, free),
      turned: minus(after.angularVelocity, freeTurn) };
  }
}

const keyOf = (body) => body.GetID().GetIndexAndSequenceNumber();

function poseOf(body) {
  const rotation = body.GetRotation();
  return [vector(body.GetPosition()), [rotation.GetW(), rotation.GetX(), rotation.GetY(), rotation.GetZ()]];
}

module.exports = { JoltContacts };
