// SPDX-License-Identifier: Apache-2.0
'use strict';

/** Vectors are arrays [x, y, z] in the world's frame, quaternions arrays [w, x, y, z]. */
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const plus = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const times = (a, factor) => [a[0] * factor, a[1] * factor, a[2] * factor];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const tangential = (v, normal) => minus(v, times(normal, dot(v, normal)));
const length = (v) => Math.sqrt(dot(v, v)); // much quicker than Math.hypot
const ZERO = [0, 0, 0];

// A striker of this mass changes the reduced mass of no real body, and one of this radius is flat.
const FLOOR = { strikerMassKg: 1e6, strikerRadiusM: 1 };

/**
 * A body as an adapter describes it: { key, massKg, centre, velocity, angularVelocity }, all but `key` absent where the
 * body stands still. `velocity` is that of the centre of mass.
 */
function velocityAt(body, point) {
  if (!body.velocity) return ZERO;
  return plus(body.velocity, cross(body.angularVelocity ?? ZERO, minus(point, body.centre)));
}

/** The velocity of the first body's surface over the second's. */
function slipAt({ first, second, point, normal }) {
  return tangential(minus(velocityAt(first, point), velocityAt(second, point)), normal);
}

/**
 * Speed at which a contact travels over the surfaces: in a slide that of one surface over the other; in a roll that of
 * the point of contact, which moves at omega R over a body whose centre of mass is at the distance R.
 */
function travelSpeed(contact) {
  const { first, second, point, normal } = contact;
  const roll = minus(first.angularVelocity ?? ZERO, second.angularVelocity ?? ZERO);
  const lever = (body) => (body.centre ? Math.abs(dot(minus(point, body.centre), normal)) : 0);
  return length(slipAt(contact)) + length(tangential(roll, normal)) * Math.max(lever(first), lever(second));
}

/**
 * Turns the contacts of an engine into what a step of a stream or trace takes, in the scene's frame. `settings` has
 * `roughness` ({ depth, irregularityLengthM }) and `striker`, the name of what bodies without a sound are made of.
 */
class ContactRows {
  constructor(settings = {}) {
    this.settings = settings;
    this.handles = new Map();
    this.partners = new Map();
    this.partnerCount = 0;
  }

  /** Lets a body sound as the object with this handle; its frame must be that of its modal model. */
  addObject(key, handle) {
    this.handles.set(key, handle);
  }

  /** Lets a body sound no more. An engine may give its key to another body later. */
  removeObject(key) {
    this.handles.delete(key);
    this.partners.delete(key);
  }

  partnerNumber(key) {
    if (!this.partners.has(key)) {
      this.partners.set(key, this.partnerCount);
      this.partnerCount += 1;
    }
    return this.partners.get(key);
  }

  /**
   * Returns the rows of one contact, in which `impulse` acts on the first body over the step: none where neither body
   * sounds. If both do, the one with the lower handle is the object. `pointOnSecond` is `point` unless it is given.
   */
  rows(contact) {
    const { first, second, point, pointOnSecond = point, normal, impulse } = contact;
    const one = this.handles.get(first.key);
    const other = this.handles.get(second.key);
    if (one === undefined && other === undefined) return [];
    if (one === undefined || other < one) {
      return this.rows({ first: second, second: first, point: pointOnSecond, pointOnSecond: point,
        normal, impulse: times(impulse, -1) });
    }
    const row = { object: one, partner: this.partnerNumber(second.key), point, impulse, normal };
    if (this.settings.roughness) {
      const { depth, irregularityLengthM } = this.settings.roughness;
      row.roughness = { depth, travelSpeedMPerS: travelSpeed(contact) };
      if (irregularityLengthM !== undefined) row.roughness.irregularityLengthM = irregularityLengthM;
    }
    if (other !== undefined) {
      row.second = { object: other, point: pointOnSecond };
    } else {
      const moves = second.massKg !== undefined;
      row.striker = { striker: this.settings.striker ?? '', ...(moves ? { strikerMassKg: second.massKg } : FLOOR) };
    }
    return [row];
  }

  /** Poses of the objects as columns; `poseOf` returns [position, orientation] of a body. */
  poses(poseOf) {
    const all = [...this.handles.keys()].map(poseOf);
    return { objects: [...this.handles.values()], positions: all.map(([position]) => position),
      orientations: all.map(([, orientation]) => orientation) };
  }
}

/**
 * Friction of contacts, for engines that report impulses along the normal alone. Each contact is { first, second, point,
 * normal, along, friction }, with `normal` pointing towards the first body and `along` the impulse on it. What the step
 * added to the momentum of a body, less gravity and the impulses along the normals, is friction, which its contacts
 * share as they share the load; none exceeds Coulomb's. Gives each contact its whole `impulse`, and returns them.
 */
function withFriction(contacts, before, gravity, stepS) {
  const rests = new Map(); // Of each body: the impulses along its normals, and what else its momentum gained.
  const restOf = (body) => {
    let rest = rests.get(body.key);
    if (rest === undefined) {
      const earlier = before.get(body.key);
      const known = earlier && earlier.velocity && body.massKg;
      const gained = known
        ? times(minus(minus(body.velocity, earlier.velocity), times(gravity, stepS)), body.massKg) : ZERO;
      rest = { known, along: 0, gained };
      rests.set(body.key, rest);
    }
    return rest;
  };
  const addUp = (body, along, normal, sign) => {
    const rest = restOf(body);
    rest.along += along;
    if (rest.known) rest.gained = minus(rest.gained, times(normal, sign * along));
  };
  for (const { first, second, normal, along } of contacts) {
    addUp(first, along, normal, 1);
    addUp(second, along, normal, -1);
  }
  for (const contact of contacts) {
    const { first, second, normal, along, friction } = contact;
    const isFirst = (first.massKg ?? Infinity) <= (second.massKg ?? Infinity);
    const rest = restOf(isFirst ? first : second);
    contact.impulse = times(normal, along);
    if (!rest.known || !friction) continue;
    const across = times(tangential(rest.gained, normal), (isFirst ? 1 : -1) * along / rest.along);
    const excess = Math.max(1, length(across) / (friction * along));
    contact.impulse = plus(contact.impulse, times(across, 1 / excess));
  }
  return contacts;
}

function reducedMassKg(first, second) {
  return 1 / (1 / (first.massKg ?? Infinity) + 1 / (second.massKg ?? Infinity));
}

/**
 * Impulse of a collision for engines that know velocities alone, N s, on the first body along `normal`, which points
 * towards it: (1 + restitution) times the speed of approach before the collision, times the reduced mass. The bodies
 * are taken for points at the contact, so that a blow beside a body's centre comes out too great.
 */
function collisionImpulse({ first, second, point, normal, restitution = 0 }) {
  const approach = -dot(minus(velocityAt(first, point), velocityAt(second, point)), normal);
  return approach > 0 ? (1 + restitution) * approach * reducedMassKg(first, second) : 0;
}

module.exports = { ContactRows, collisionImpulse, cross, minus, plus, reducedMassKg, slipAt, times, withFriction };
