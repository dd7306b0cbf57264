// SPDX-License-Identifier: Apache-2.0
'use strict';

const { ContactRows, plus, times } = require('./contact_rows');

const vector = ({ x, y, z }) => [x, y, z];

/**
 * Reads the contacts of a cannon-es world. Open the stream or trace with frame 'scene'. The engine has the force of
 * each contact and of its friction as the multipliers of its equations.
 */
class CannonContacts {
  constructor(settings = {}) {
    this.contactRows = new ContactRows(settings);
    this.bodies = new Map();
  }

  /** Lets a Body sound as the object with this handle; its frame must be that of its modal model. */
  addObject(body, handle) {
    this.contactRows.addObject(body.id, handle);
    this.bodies.set(body.id, body);
  }

  /** Lets a Body sound no more. A body that is removed from its world is forgotten without it. */
  removeObject(body) {
    this.contactRows.removeObject(body.id);
    this.bodies.delete(body.id);
  }

  /**
   * Returns what a step of a stream or trace takes. Call it after each step that the engine computes: after
   * world.step(dt) without a time since the last call, otherwise in the world's event 'postStep'. The poses are those
   * from before the step, to which the engine's points belong.
   */
  read(world) {
    for (const body of this.bodies.values()) if (body.world !== world) this.removeObject(body);
    const contacts = [];
    for (const equation of world.contacts) {
      if (!this.bodies.has(equation.bi.id) && !this.bodies.has(equation.bj.id)) continue;
      // The normal points from the first body to the second.
      const normal = times(vector(equation.ni), -1);
      contacts.push({ equation, first: describe(equation.bi), second: describe(equation.bj), normal,
        impulse: times(normal, equation.multiplier * world.dt),
        point: plus(vector(equation.bi.previousPosition), vector(equation.ri)),
        pointOnSecond: plus(vector(equation.bj.previousPosition), vector(equation.rj)) });
    }
    this.addFriction(contacts, world);
    const rows = contacts.filter(({ impulse }) => impulse.some((x) => x !== 0))
      .flatMap((contact) => this.contactRows.rows(contact));
    return { contacts: rows, poses: this.contactRows.poses((key) => poseOf(this.bodies.get(key))) };
  }

  /** Each friction belongs to the nearest contact of its pair, or lies in the middle of all of them. */
  addFriction(contacts, world) {
    for (const { bi, bj, ri, t, multiplier } of world.frictionEquations) {
      let nearest;
      let least = Infinity;
      for (const contact of contacts) {
        const { equation } = contact;
        if (equation.bi !== bi || equation.bj !== bj) continue;
        const distance = equation.ri.distanceTo(ri);
        if (distance < least) [nearest, least] = [contact, distance];
      }
      if (nearest) nearest.impulse = plus(nearest.impulse, times(vector(t), -multiplier * world.dt));
    }
  }
}

function poseOf({ previousPosition, previousQuaternion: { w, x, y, z } }) {
  return [vector(previousPosition), [w, x, y, z]];
}

function describe(body) {
  if (!(body.invMass > 0)) return { key: body.id };
  return { key: body.id, massKg: body.mass, centre: vector(body.previousPosition), velocity: vector(body.velocity),
    angularVelocity: vector(body.angularVelocity) };
}

module.exports = { CannonContacts };
