// SPDX-License-Identifier: Apache-2.0
'use strict';

const { ContactRows, cross, minus, plus, times } = require('./contact_rows');

// mjCONE_PYRAMIDAL of mjtCone.
const PYRAMIDAL = 0;

/** Three or more numbers of an array of vectors. */
const at = (array, index, count = 3) => Array.from(array.subarray(count * index, count * (index + 1)));

/**
 * Reads the contacts of a MuJoCo model (npm mujoco-js). Open the stream or trace with frame 'scene'. Contacts are
 * soft in MuJoCo and spread a blow over several steps; the daemon gathers these.
 */
class MujocoContacts {
  constructor(model, settings = {}) {
    this.model = model;
    this.contactRows = new ContactRows(settings);
  }

  /** Lets the body with the number `body`, 1 or more, sound as the object with this handle. */
  addObject(body, handle) {
    this.contactRows.addObject(body, handle);
  }

  /** Lets the body sound no more. */
  removeObject(body) {
    this.contactRows.removeObject(body);
  }

  /**
   * Returns what a step of a stream or trace takes. Call it after mj_step. The poses are those when the step began, as
   * mj_step leaves them.
   */
  read(data) {
    const rows = [];
    const forces = data.efc_force;
    const all = data.contact;
    for (let i = 0; i < all.size(); i += 1) {
      const contact = all.get(i);
      if (contact.efc_address >= 0) rows.push(...this.rowsOf(data, contact, forces));
      contact.delete();
    }
    all.delete();
    const { xpos, xquat } = data;
    return { contacts: rows, poses: this.contactRows.poses((body) => [at(xpos, body), at(xquat, body, 4)]) };
  }

  rowsOf(data, contact, forces) {
    const [first, second] = [contact.geom1, contact.geom2].map((geom) => this.bodyOf(data, geom));
    const frame = contact.frame; // Its rows are the normal, which points to the second body, and two tangents.
    const [normal, ...tangents] = [0, 1, 2].map((row) => at(frame, row));
    const [along, ...across] = this.forceOf(contact, forces);
    // The force is that on the second body.
    const force = plus(plus(times(normal, along), times(tangents[0], across[0])), times(tangents[1], across[1]));
    const impulse = times(force, -this.model.opt.timestep);
    if (!impulse.some((x) => x !== 0)) return [];
    return this.contactRows.rows({ first, second, point: Array.from(contact.pos), normal: times(normal, -1), impulse });
  }

  /** The force along the axes of the contact's frame, newtons: mj_contactForce, which takes no arrays of JavaScript. */
  forceOf({ dim, efc_address: address, friction }, forces) {
    if (dim === 1) return [forces[address], 0, 0];
    if (this.model.opt.cone !== PYRAMIDAL) return [forces[address], forces[address + 1], forces[address + 2]];
    // Each axis but the first has two edges of the pyramid.
    const force = [0, 0, 0];
    for (let axis = 0; axis < dim - 1; axis += 1) {
      const [one, other] = [forces[address + 2 * axis], forces[address + 2 * axis + 1]];
      force[0] += one + other;
      if (axis < 2) force[axis + 1] = friction[axis] * (one - other);
    }
    return force;
  }

  bodyOf(data, geom) {
    const { model } = this;
    const body = model.geom_bodyid[geom];
    if (model.body_weldid[body] === 0) return { key: body };
    // cvel has the turning, and the velocity of what lies at the centre of the whole tree.
    const [turning, moving] = [at(data.cvel, 2 * body), at(data.cvel, 2 * body + 1)];
    const centre = at(data.xipos, body);
    const arm = minus(centre, at(data.subtree_com, model.body_rootid[body]));
    return { key: body, massKg: model.body_mass[body], centre, velocity: plus(moving, cross(turning, arm)),
      angularVelocity: turning };
  }
}

module.exports = { MujocoContacts };
