// SPDX-License-Identifier: Apache-2.0
'use strict';

const rapier = require('@dimforge/rapier3d-compat');
const { cross, minus, plus, times } = require('../../adapters/contact_rows');
const { RapierContacts } = require('../../adapters/rapier_contacts');

const vector = ([x, y, z]) => ({ x, y, z });
const quaternion = ([w, x, y, z]) => ({ x, y, z, w });
const NOT_TURNED = [1, 0, 0, 0];
// Rapier has no half spaces; a box below z = 0 stands for one.
const GROUND_M = [20, 20, 1];
// Rapier's tolerances are multiples of this length, which should be the size of the bodies. With the default of one
// metre Rapier looks for contacts 2 mm ahead, and its friction stops a bowl that rolls on its rim.
const LENGTH_UNIT_M = 0.1;
// The radius of a face's feet, as a part of the distance from the middle of the face to its corners.
const FOOT = 0.05;
// The feet reach this far below their face, so that they bear the body alone.
const FOOT_BELOW_M = 0.0001;

const hull = (corners) => rapier.ColliderDesc.convexHull(new Float32Array(corners.flat()));

/** The faces of a hull that Rapier has made: the corners of each, [x, y, z] in the body's frame, and its normal. */
function faces(collider) {
  const [vertices, indices] = [collider.vertices(), collider.indices()];
  const corner = (number) => [...vertices.slice(3 * number, 3 * number + 3)];
  const found = new Map();
  for (let i = 0; i < indices.length; i += 3) {
    const numbers = [...indices.slice(i, i + 3)];
    const [a, b, c] = numbers.map(corner);
    const across = cross(minus(b, a), minus(c, a));
    const normal = times(across, 1 / Math.hypot(...across));
    const key = normal.map((x) => Math.round(1000 * x)).join(' ');
    found.set(key, { normal, numbers: new Set([...(found.get(key)?.numbers ?? []), ...numbers]) });
  }
  return [...found.values()].map(({ normal, numbers }) => ({ normal, corners: [...numbers].map(corner) }));
}

/** Four corners of a face that lie far apart: each is the farthest from those before it. */
function spread(corners) {
  const chosen = [corners[0]];
  const distance = (corner) => Math.min(...chosen.map((other) => Math.hypot(...minus(corner, other))));
  while (chosen.length < 4) {
    chosen.push(corners.reduce((best, corner) => (distance(corner) > distance(best) ? corner : best)));
  }
  return chosen;
}

/**
 * Rapier finds contacts at four adjacent corners of a face and at the deepest point only. A bowl that lies on its rim
 * would therefore rattle. Each face of a hull with more corners gets four balls as feet. They lie beside the corners, so
 * that a body that leans and rolls over its corners does not touch the ground with its feet.
 */
function feet(collider) {
  return faces(collider).filter(({ corners }) => corners.length > 4).flatMap(({ normal, corners }) => {
    const middle = times(corners.reduce((sum, corner) => plus(sum, corner)), 1 / corners.length);
    return spread(corners).map((corner) => {
      const inward = times(minus(middle, corner), FOOT);
      const radius = Math.hypot(...inward);
      const at = plus(plus(corner, inward), times(normal, FOOT_BELOW_M - radius));
      return rapier.ColliderDesc.ball(radius).setTranslation(...at);
    });
  });
}

/** The colliders of a shape in the frame of its body. */
function colliders(shape) {
  if (shape.ball) return [rapier.ColliderDesc.ball(shape.ball.radius_m)];
  if (shape.hull) return [hull(shape.hull.corners_m)];
  const boxes = shape.boxes ?? [{ sides_m: GROUND_M, position_m: [0, 0, -GROUND_M[2] / 2] }];
  return boxes.map(({ sides_m: [x, y, z], position_m: position = [0, 0, 0], orientation = NOT_TURNED }) =>
    rapier.ColliderDesc.cuboid(x / 2, y / 2, z / 2).setTranslation(...position).setRotation(quaternion(orientation)));
}

function addBody(world, scene, body) {
  const description = body.mass_kg ? rapier.RigidBodyDesc.dynamic() : rapier.RigidBodyDesc.fixed();
  description.setTranslation(...(body.position_m ?? [0, 0, 0])).setRotation(quaternion(body.orientation ?? NOT_TURNED))
    .setLinvel(...(body.velocity_m_per_s ?? [0, 0, 0])).setAngvel(vector(body.angular_velocity_rad_per_s ?? [0, 0, 0]))
    .setCanSleep(false);
  if (body.mass_kg) {
    description.setAdditionalMassProperties(body.mass_kg, vector([0, 0, 0]), vector(body.inertia_kg_m2),
      quaternion(NOT_TURNED));
  }
  const made = world.createRigidBody(description);
  const add = (collider) => world.createCollider(collider.setDensity(0).setFriction(scene.friction)
    .setRestitution(scene.restitution), made);
  const added = colliders(body.shape).map(add);
  if (body.shape.hull) feet(added[0]).forEach(add);
  return made;
}

async function start(scene, stepS, settings) {
  await rapier.init();
  const world = new rapier.World(vector(scene.gravity_m_per_s2 ?? [0, 0, -9.81]));
  world.timestep = stepS;
  world.lengthUnit = LENGTH_UNIT_M;
  const contacts = new RapierContacts(settings);
  scene.bodies.forEach((body, i) => {
    const made = addBody(world, scene, body);
    if (body.model) contacts.addObject(made, i + 1);
  });
  return { step: () => {
    world.step();
    return contacts.read(world);
  } };
}

module.exports = { start };
