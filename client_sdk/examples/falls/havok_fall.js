// SPDX-License-Identifier: Apache-2.0
'use strict';

const fs = require('fs');
const HavokPhysics = require('@babylonjs/havok');
const { cross } = require('../../adapters/contact_rows');
const { HavokContacts } = require('../../adapters/havok_contacts');

const NOT_TURNED = [1, 0, 0, 0];
const quaternion = ([w, x, y, z]) => [x, y, z, w];
// Havok has no half spaces; a box below z = 0 stands for one.
const GROUND_M = [20, 20, 1];
// Havok rounds a box's corners off by 1.5 cm. For a thinner box it reports points metres away from both bodies; a hull
// has no such fault.
const THINNEST_BOX_M = 0.04;

/** `vector` turned by a quaternion [w, x, y, z]. */
function rotated([w, ...axis], vector) {
  const twice = cross(axis, vector).map((c) => 2 * c);
  const further = cross(axis, twice);
  return vector.map((v, i) => v + w * twice[i] + further[i]);
}

function hull(havok, corners) {
  const address = havok._malloc(12 * corners.length);
  havok.HEAPF32.set(corners.flat(), address / 4);
  const [, shape] = havok.HP_Shape_CreateConvexHull(address, corners.length);
  havok._free(address);
  return shape;
}

function box(havok, { sides_m: sides, position_m: position = [0, 0, 0], orientation = NOT_TURNED }) {
  if (Math.min(...sides) >= THINNEST_BOX_M) {
    return havok.HP_Shape_CreateBox(position, quaternion(orientation), sides)[1];
  }
  const signs = [-0.5, 0.5];
  const corners = signs.flatMap((x) => signs.flatMap((y) => signs.map((z) =>
    [x * sides[0], y * sides[1], z * sides[2]])));
  return hull(havok, corners.map((corner) => rotated(orientation, corner).map((c, i) => c + position[i])));
}

/** The shape in the frame of its body. */
function makeShape(havok, shape) {
  if (shape.ball) return havok.HP_Shape_CreateSphere([0, 0, 0], shape.ball.radius_m)[1];
  if (shape.hull) return hull(havok, shape.hull.corners_m);
  const boxes = shape.boxes ?? [{ sides_m: GROUND_M, position_m: [0, 0, -GROUND_M[2] / 2] }];
  const made = boxes.map((each) => box(havok, each));
  if (made.length === 1) return made[0];
  const [, container] = havok.HP_Shape_CreateContainer();
  for (const part of made) havok.HP_Shape_AddChild(container, part, [[0, 0, 0], [0, 0, 0, 1], [1, 1, 1]]);
  return container;
}

function addBody(havok, world, scene, body) {
  const shape = makeShape(havok, body.shape);
  const combine = havok.MaterialCombine.GEOMETRIC_MEAN;
  havok.HP_Shape_SetMaterial(shape, [scene.friction, scene.friction, scene.restitution, combine, combine]);
  const [, made] = havok.HP_Body_Create();
  havok.HP_Body_SetShape(made, shape);
  havok.HP_Body_SetMotionType(made, body.mass_kg ? havok.MotionType.DYNAMIC : havok.MotionType.STATIC);
  if (body.mass_kg) {
    // Havok's moments of inertia are those of a mass of one.
    const inertia = body.inertia_kg_m2.map((moment) => moment / body.mass_kg);
    havok.HP_Body_SetMassProperties(made, [[0, 0, 0], body.mass_kg, inertia, [0, 0, 0, 1]]);
    havok.HP_Body_SetLinearDamping(made, 0);
    havok.HP_Body_SetAngularDamping(made, 0);
    havok.HP_Body_SetActivationControl(made, havok.ActivationControl.ALWAYS_ACTIVE);
  }
  havok.HP_Body_SetQTransform(made, [body.position_m ?? [0, 0, 0], quaternion(body.orientation ?? NOT_TURNED)]);
  havok.HP_Body_SetEventMask(made, HavokContacts.eventMask(havok));
  havok.HP_World_AddBody(world, made, false);
  havok.HP_Body_SetLinearVelocity(made, body.velocity_m_per_s ?? [0, 0, 0]);
  havok.HP_Body_SetAngularVelocity(made, body.angular_velocity_rad_per_s ?? [0, 0, 0]);
  return made;
}

async function start(scene, stepS, settings) {
  const wasmBinary = fs.readFileSync(require.resolve('@babylonjs/havok/lib/umd/HavokPhysics.wasm'));
  const havok = await HavokPhysics({ wasmBinary });
  const [, world] = havok.HP_World_Create();
  const gravity = scene.gravity_m_per_s2 ?? [0, 0, -9.81];
  havok.HP_World_SetGravity(world, gravity);
  havok.HP_World_SetIdealStepTime(world, stepS);
  const { friction, restitution } = scene;
  const contacts = new HavokContacts(havok, { ...settings, friction, restitution, gravity });
  scene.bodies.forEach((body, i) => {
    const made = addBody(havok, world, scene, body);
    if (body.model) contacts.addObject(made, i + 1);
  });
  return { step: () => {
    havok.HP_World_Step(world, stepS);
    return contacts.read(world, stepS);
  } };
}

module.exports = { start };
