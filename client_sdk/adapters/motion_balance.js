// SPDX-License-Identifier: Apache-2.0
'use strict';

const { cross, minus, plus, times } = require('./contact_rows');

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const ZERO = [0, 0, 0];
const SWEEPS = 200;
// Part of the greatest change of speed, below which a change is as good as none.
const ENOUGH = 1e-6;

/** What a vector becomes by a matrix of rows. */
const turned = (matrix, v) => [dot(matrix[0], v), dot(matrix[1], v), dot(matrix[2], v)];

/** Solves the three equations of a symmetric matrix above zero, by Cramer's rule. */
function solved(matrix, v) {
  const [a, b, c] = matrix;
  const bc = cross(b, c);
  return times(plus(plus(times(bc, v[0]), times(cross(c, a), v[1])), times(cross(a, b), v[2])), 1 / dot(a, bc));
}

/** How a body's point changes its velocity by an impulse there: the matrix of 1/m - [r] I^-1 [r]. */
function addMobility(matrix, body, arm) {
  if (!body.inverseInertia) return;
  for (let axis = 0; axis < 3; axis += 1) {
    const unit = [0, 0, 0];
    unit[axis] = 1;
    const moved = cross(turned(body.inverseInertia, cross(arm, unit)), arm);
    for (let row = 0; row < 3; row += 1) matrix[row][axis] += moved[row] + (row === axis ? 1 / body.massKg : 0);
  }
}

/**
 * Impulses for engines that report where bodies touch, but not how strongly: those that change the velocities of the
 * bodies as the step did. Each contact is { first, second, point, normal, friction }, with `normal` pointing towards
 * the first body. A body is as ContactRows describes it, with `inverseInertia`, three rows in the world's frame, and
 * `gained` and `turned`, the changes of its velocity and its angular velocity in the step that are not those of
 * gravity, damping and the like; without them it is not balanced, and only its partner's change counts. Solves by
 * blocks, after Gauss and Seidel, within the cones of friction. Gives each contact its `impulse` on the first body, and
 * returns the contacts that have one.
 */
function balanced(contacts) {
  const bodies = new Map(); // What remains to be explained.
  for (const { first, second } of contacts) {
    for (const body of [first, second]) {
      if (!body.inverseInertia || bodies.has(body.key)) continue;
      bodies.set(body.key, { gained: body.gained, turned: body.turned });
    }
  }
  const blocks = contacts.map((contact) => {
    const { first, second, point } = contact;
    const arms = [first, second].map((body) => (body.inverseInertia ? minus(point, body.centre) : ZERO));
    const matrix = [[0, 0, 0], [0, 0, 0], [0, 0, 0]];
    addMobility(matrix, first, arms[0]);
    addMobility(matrix, second, arms[1]);
    contact.impulse = ZERO;
    return { contact, arms, matrix };
  });
  const speedAt = (body, arm) => {
    const left = bodies.get(body.key);
    return left ? plus(left.gained, cross(left.turned, arm)) : ZERO;
  };
  const strike = (body, arm, impulse) => {
    const left = bodies.get(body.key);
    if (!left) return;
    left.gained = minus(left.gained, times(impulse, 1 / body.massKg));
    left.turned = minus(left.turned, turned(body.inverseInertia, cross(arm, impulse)));
  };
  let greatest = 0;
  for (let sweep = 0; sweep < SWEEPS; sweep += 1) {
    let changed = 0;
    for (const { contact, arms, matrix } of blocks) {
      const { first, second, normal, friction } = contact;
      const left = minus(speedAt(first, arms[0]), speedAt(second, arms[1]));
      const wanted = inCone(plus(contact.impulse, solved(matrix, left)), normal, friction);
      const change = minus(wanted, contact.impulse);
      strike(first, arms[0], change);
      strike(second, arms[1], times(change, -1));
      contact.impulse = wanted;
      changed = Math.max(changed, Math.sqrt(dot(change, change)));
    }
    greatest = Math.max(greatest, changed);
    if (changed <= ENOUGH * greatest) break;
  }
  return contacts.filter(({ impulse }) => impulse.some((x) => x !== 0));
}

/** The impulse whose part along the normal presses, and whose friction is no greater than Coulomb's. */
function inCone(impulse, normal, friction) {
  const along = dot(impulse, normal);
  if (!(along > 0)) return ZERO;
  const across = minus(impulse, times(normal, along));
  const excess = Math.sqrt(dot(across, across)) / (friction * along || 1e-300);
  return plus(times(normal, along), times(across, excess > 1 ? 1 / excess : 1));
}

module.exports = { balanced };
