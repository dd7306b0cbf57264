// SPDX-License-Identifier: Apache-2.0
'use strict';

/** Vectors are arrays [x, y, z] in the world's frame, quaternions arrays [w, x, y, z]. */
const minus = (a, b) => a.map((x, i) => x - b[i]);
const plus = (a, b) => a.map((x, i) => x + b[i]);
const times = (a, factor) => a.map((x) => x * factor);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const tangential = (v, normal) => minus(v, times(normal, dot(v, normal)));
const length = (v) => Math.hypot(...v);

// A striker of this mass changes the reduced mass of no real body.
const IMMOVABLE_KG = 1e6;

/**
 * A body as an adapter describes it: { key, massKg, centre, velocity, angularVelocity }, all but `key` absent where the
 * body stands still. `velocity` is that of the centre of mass.
 */
function velocityAt(body, point) {
  if (!body.velocity) return [0, 0, 0];
  const turning = cross(body.angularVelocity ?? [0, 0, 0], minus(point, body.centre));
  return body.velocity.map((v, i) => v + turning[i]);
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
  const roll = minus(first.angularVelocity ?? [0, 0, 0], second.angularVelocity ?? [0, 0, 0]);
  const lever = (body) => (body.centre ? Math.abs(dot(minus(point, body.centre), normal)) : 0);
  return length(slipAt(contact)) + length(tangential(roll, normal)) * Math.max(lever(first), lever(second));
}

/**
 * Turns the contacts of an engine into what a step of a stream or trace takes, in the scene's frame. `settings` has
 * `roughness` ({ depth, irregularity_length_m }) and `striker`, the name of what bodies without a sound are made of.
 */
class ContactRows {
  constructor(settings = {}) {
    this.settings = settings;
    this.handles = new Map();
    this.partners = new Map();
  }

  /** Lets a body sound as the object with this handle; its frame must be that of its modal model. */
  addObject(key, handle) {
    this.handles.set(key, handle);
  }

  partnerNumber(key) {
    if (!this.partners.has(key)) this.partners.set(key, this.partners.size);
    return this.partners.get(key);
  }

  /**
   * Returns the rows of one contact, in which `impulse` acts on the first body over the step: none where neither body
   * sounds. If both do, the one with the lower handle is the object. `pointOnSecond` is `point` unless it is given.
   */
  rows({ first, second, point, pointOnSecond = point, normal, impulse }) {
    const [one, other] = [this.handles.get(first.key), this.handles.get(second.key)];
    if (one === undefined && other === undefined) return [];
    if (one === undefined || other < one) {
      return this.rows({ first: second, second: first, point: pointOnSecond, pointOnSecond: point,
        normal, impulse: times(impulse, -1) });
    }
    const row = { object: one, partner: this.partnerNumber(second.key), point, impulse };
    if (this.settings.roughness) {
      const travel = travelSpeed({ first, second, point, normal });
      row.roughness = { ...this.settings.roughness, travel_speed_m_per_s: travel };
    }
    if (other !== undefined) return [{ ...row, second: { object: other, point: pointOnSecond } }];
    const striker = { striker: this.settings.striker ?? '', striker_mass_kg: second.massKg ?? IMMOVABLE_KG };
    return [{ ...row, striker }];
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
 * share as they share the load; none exceeds Coulomb's. Returns the contacts with their whole `impulse`.
 */
function withFriction(contacts, before, gravity, stepS) {
  const loads = new Map();
  for (const { first, second, normal, along } of contacts) {
    for (const [body, sign] of [[first, 1], [second, -1]]) {
      const load = loads.get(body.key) ?? { along: 0, normal: [0, 0, 0] };
      loads.set(body.key, { along: load.along + along, normal: plus(load.normal, times(normal, sign * along)) });
    }
  }
  return contacts.map((contact) => {
    const { first, second, normal, along, friction } = contact;
    const isFirst = (first.massKg ?? Infinity) <= (second.massKg ?? Infinity);
    const body = isFirst ? first : second;
    const earlier = before.get(body.key);
    if (!earlier || !body.massKg) return { ...contact, impulse: times(normal, along) };
    const gained = minus(minus(body.velocity, earlier.velocity), times(gravity, stepS));
    const load = loads.get(body.key);
    const rest = tangential(minus(times(gained, body.massKg), load.normal), normal);
    const across = times(rest, (isFirst ? 1 : -1) * along / load.along);
    const excess = Math.max(1, length(across) / (friction * along || Infinity));
    return { ...contact, impulse: plus(times(normal, along), times(across, friction ? 1 / excess : 0)) };
  });
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
