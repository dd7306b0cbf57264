// SPDX-License-Identifier: Apache-2.0
'use strict';

/** Vectors are arrays [x, y, z] in the world's frame, quaternions arrays [w, x, y, z]. */
const minus = (a, b) => a.map((x, i) => x - b[i]);
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

/**
 * Speed at which a contact travels over the surfaces: in a slide that of one surface over the other; in a roll that of
 * the point of contact, which moves at omega R over a body whose centre of mass is at the distance R.
 */
function travelSpeed(first, second, point, normal) {
  const slip = minus(velocityAt(first, point), velocityAt(second, point));
  const roll = minus(first.angularVelocity ?? [0, 0, 0], second.angularVelocity ?? [0, 0, 0]);
  const lever = (body) => (body.centre ? Math.abs(dot(minus(point, body.centre), normal)) : 0);
  return length(tangential(slip, normal)) + length(tangential(roll, normal)) * Math.max(lever(first), lever(second));
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
   * sounds. If both do, the one with the lower handle is the object.
   */
  rows({ first, second, point, normal, impulse }) {
    const [one, other] = [this.handles.get(first.key), this.handles.get(second.key)];
    if (one === undefined && other === undefined) return [];
    if (one === undefined || other < one) {
      return this.rows({ first: second, second: first, point, normal, impulse: times(impulse, -1) });
    }
    const row = { object: one, partner: this.partnerNumber(second.key), point, impulse };
    if (this.settings.roughness) {
      const travel = travelSpeed(first, second, point, normal);
      row.roughness = { ...this.settings.roughness, travel_speed_m_per_s: travel };
    }
    if (other !== undefined) return [{ ...row, second: { object: other, point } }];
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
 * Friction of Coulomb on the first body, for engines that report impulses along the normal alone: against the slip, and
 * no greater than what stops it.
 */
function frictionImpulse({ first, second, point, normal }, normalImpulse, friction) {
  const slip = tangential(minus(velocityAt(first, point), velocityAt(second, point)), normal);
  const speed = length(slip);
  const stops = speed * reducedMassKg(first, second);
  return speed > 0 ? times(slip, -Math.min(friction * normalImpulse, stops) / speed) : [0, 0, 0];
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

module.exports = { ContactRows, collisionImpulse, frictionImpulse, times };
