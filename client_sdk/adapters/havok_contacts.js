// SPDX-License-Identifier: Apache-2.0
'use strict';

const { ContactRows, collisionImpulse, times, withFriction } = require('./contact_rows');

/**
 * Reads the collision events of a Havok world. Open the stream or trace with frame 'scene', and let each body that
 * sounds raise events: HP_Body_SetEventMask(body, HavokContacts.eventMask(havok)). `settings` has `friction`,
 * `restitution` and `gravity` of the world beside what ContactRows takes.
 */
class HavokContacts {
  constructor(havok, settings = {}) {
    this.havok = havok;
    this.friction = settings.friction ?? 0;
    this.restitution = settings.restitution ?? 0;
    this.gravity = settings.gravity ?? [0, 0, 0];
    this.contactRows = new ContactRows(settings);
    this.before = new Map(); // Bodies as they were after the step before.
    this.posesBefore = new Map();
  }

  /** The sum of the events that the adapter reads. */
  static eventMask({ EventType }) {
    return EventType.COLLISION_STARTED.value | EventType.COLLISION_CONTINUED.value;
  }

  /** Lets a body sound as the object with this handle; its frame must be that of its modal model. */
  addObject(body, handle) {
    this.contactRows.addObject(body[0], handle);
    this.before.set(body[0], this.bodyOf(body));
    this.posesBefore.set(body[0], this.poseOf(body));
  }

  /**
   * Returns what a step of a stream or trace takes. Call it after HP_World_Step(world, stepS). The poses are those from
   * before the step, to which the points of Havok's events belong.
   */
  read(world, stepS) {
    const events = this.events(world);
    const found = events.flatMap((event) => this.readEvent(event, isSilent(event, events)));
    const contacts = withFriction(found, this.before, this.gravity, stepS)
      .flatMap((contact) => this.contactRows.rows(contact));
    const poses = this.contactRows.poses((key) => this.posesBefore.get(key));
    for (const key of this.before.keys()) {
      this.before.set(key, this.bodyOf([key]));
      this.posesBefore.set(key, this.poseOf([key]));
    }
    return { contacts, poses };
  }

  /** Collisions that have begun or go on: one that has finished repeats the impulse of its last step. */
  events(world) {
    const { EventType } = this.havok;
    const found = [];
    let event = this.havok.HP_World_GetCollisionEvents(world)[1];
    while (event) {
      const [type, one, other, impulse] = this.havok.HP_Event_AsCollision(event)[1];
      const began = typeOf(type) === EventType.COLLISION_STARTED.value;
      const pair = `${one[0][0]} ${other[0][0]}`;
      if (typeOf(type) !== EventType.COLLISION_FINISHED.value) found.push({ began, pair, one, other, impulse });
      event = this.havok.HP_World_GetNextCollisionEvent(Number(world[0]), event);
    }
    return found;
  }

  /** Each event has the normal out of both bodies, against which the impulse acts, without friction. */
  readEvent({ one, other, impulse }, silent) {
    const [first, second] = [this.bodyOf(one[0]), this.bodyOf(other[0])];
    const [point, normal] = [[...one[3]], times(one[4], -1)];
    const along = silent ? this.derived(one[0], other[0], point, normal) : impulse;
    return along > 0 ? [{ first, second, point, normal, along, friction: this.friction }] : [];
  }

  /** The impulse of a collision that Havok reports with zero, from the velocities before the step. */
  derived(one, other, point, normal) {
    const [first, second] = [one, other].map((body) => this.before.get(body[0]) ?? this.bodyOf(body));
    return collisionImpulse({ first, second, point, normal, restitution: this.restitution });
  }

  bodyOf(body) {
    const { havok } = this;
    if (havok.HP_Body_GetMotionType(body)[1].value !== havok.MotionType.DYNAMIC.value) return { key: body[0] };
    return { key: body[0], massKg: havok.HP_Body_GetMassProperties(body)[1][1],
      centre: [...havok.HP_Body_GetPosition(body)[1]], velocity: [...havok.HP_Body_GetLinearVelocity(body)[1]],
      angularVelocity: [...havok.HP_Body_GetAngularVelocity(body)[1]] };
  }

  poseOf(body) {
    const [[...position], [x, y, z, w]] = this.havok.HP_Body_GetQTransform(body)[1];
    return [position, [w, x, y, z]];
  }
}

const typeOf = (type) => type.value ?? type;

/** Whether a collision began and no point of the pair has an impulse; its first point then stands for all. */
function isSilent(event, events) {
  const all = events.filter(({ pair }) => pair === event.pair);
  return all[0] === event && all.every(({ began, impulse }) => began && impulse === 0);
}

module.exports = { HavokContacts };
