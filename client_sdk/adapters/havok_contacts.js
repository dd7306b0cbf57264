// SPDX-License-Identifier: Apache-2.0
'use strict';

const { ContactRows, collisionImpulse, plus, times, withFriction } = require('./contact_rows');

// A contact does not wait for the rest of its blow if the rest is at most this part of its impulse: it is inaudible.
const UNFINISHED = 0.01;

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
    this.unfinished = []; // Contacts that wait for the rest of their blow, which the next step has.
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

  /** Lets a body sound no more. Call it before HP_Body_Release(body). */
  removeObject(body) {
    this.contactRows.removeObject(body[0]);
    this.before.delete(body[0]);
    this.posesBefore.delete(body[0]);
  }

  /**
   * Returns what a step of a stream or trace takes. Call it after HP_World_Step(world, stepS). The poses are those from
   * before the step, to which the points of Havok's events belong.
   */
  read(world, stepS) {
    const events = this.events(world);
    const found = events.flatMap((event) => this.readEvent(event, isSilent(event, events)));
    const contacts = this.wholeBlows(withFriction(found, this.before, this.gravity, stepS))
      .flatMap((contact) => this.contactRows.rows(contact));
    const poses = this.contactRows.poses((key) => this.posesBefore.get(key));
    for (const key of this.before.keys()) {
      this.before.set(key, this.bodyOf([key]));
      this.posesBefore.set(key, this.poseOf([key]));
    }
    return { contacts, poses };
  }

  /**
   * Havok stops two bodies before they touch: the step in which a collision begins leaves them the speed that closes
   * their gap, and the next step takes the rest. A contact that has begun while its bodies still approach therefore
   * waits for the next step, in which the pair's nearest contact gets the impulse of both steps.
   */
  wholeBlows(contacts) {
    const waiting = this.unfinished;
    this.unfinished = contacts.filter(isUnfinished);
    const told = contacts.filter((contact) => !isUnfinished(contact));
    for (const part of waiting) {
      const [nearest] = contacts.filter(({ pair }) => pair === part.pair)
        .sort((a, b) => distance(a.point, part.point) - distance(b.point, part.point));
      if (nearest) nearest.impulse = plus(nearest.impulse, part.impulse);
      else told.push(part);
    }
    return told;
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
  readEvent({ began, pair, one, other, impulse }, silent) {
    const [first, second] = [this.bodyOf(one[0]), this.bodyOf(other[0])];
    const [point, normal] = [[...one[3]], times(one[4], -1)];
    const along = silent ? this.derived(one[0], other[0], point, normal) : impulse;
    if (!(along > 0)) return [];
    return [{ first, second, point, normal, along, friction: this.friction, pair, began: began && !silent }];
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

const distance = (a, b) => Math.hypot(...a.map((x, i) => x - b[i]));

/** Whether the step has left the bodies of a contact that has begun a part of the speed at which they approached. */
function isUnfinished({ began, first, second, point, normal, along }) {
  return began && collisionImpulse({ first, second, point, normal }) > UNFINISHED * along;
}

module.exports = { HavokContacts };
