// SPDX-License-Identifier: Apache-2.0
'use strict';

const rapier = require('@dimforge/rapier3d-compat');
const { RapierContacts } = require('../../adapters/rapier_contacts');

const vector = ([x, y, z]) => ({ x, y, z });
const quaternion = ([w, x, y, z]) => ({ x, y, z, w });
const NOT_TURNED = [1, 0, 0, 0];
// Rapier has no half spaces; a box below z = 0 stands for one.
const GROUND_M = [20, 20, 1];

/** The colliders of a shape in the frame of its body. */
function colliders(shape) {
  if (shape.ball) return [rapier.ColliderDesc.ball(shape.ball.radius_m)];
  if (shape.hull) return [rapier.ColliderDesc.convexHull(new Float32Array(shape.hull.corners_m.flat()))];
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
  for (const collider of colliders(body.shape)) {
    world.createCollider(collider.setDensity(0).setFriction(scene.friction).setRestitution(scene.restitution), made);
  }
  return made;
}

async function start(scene, stepS, settings) {
  await rapier.init();
  const world = new rapier.World(vector(scene.gravity_m_per_s2 ?? [0, 0, -9.81]));
  world.timestep = stepS;
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
