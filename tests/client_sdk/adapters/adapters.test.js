// SPDX-License-Identifier: Apache-2.0
'use strict';

const assert = require('node:assert/strict');
const path = require('node:path');
const { test } = require('node:test');
const rapier = require('@dimforge/rapier3d-compat');

const adapters = path.resolve(__dirname, '../../../client_sdk/adapters');
const { ContactRows } = require(path.join(adapters, 'contact_rows'));
const { HavokContacts } = require(path.join(adapters, 'havok_contacts'));
const { RapierContacts } = require(path.join(adapters, 'rapier_contacts'));
const { VelocityContacts } = require(path.join(adapters, 'velocity_contacts'));

const { GRAVITY_M_PER_S2, HALF_M, HEIGHT_M, MASS_KG, engines } = require('./drops');

const STEP_S = 1 / 240;
const near = (actual, expected, tolerance) => assert.ok(Math.abs(actual - expected) <= tolerance,
  `${actual} is not ${expected}`);
const sum = (contacts) => contacts.reduce((total, { impulse }) => total.map((x, i) => x + impulse[i]), [0, 0, 0]);

const still = (key) => ({ key });
const moving = (key, massKg, velocity) => ({ key, massKg, centre: [0, 0, 0], velocity, angularVelocity: [0, 0, 0] });

test('the object with the lower handle is the object of a row, however the engine orders the bodies', () => {
  const rows = new ContactRows();
  rows.addObject('a', 4);
  rows.addObject('b', 2);
  const contact = { point: [1, 0, 0], pointOnSecond: [2, 0, 0], normal: [0, 0, 1], impulse: [0, 0, 3] };
  const [row] = rows.rows({ ...contact, first: still('a'), second: still('b') });
  assert.deepEqual([row.object, row.point, row.second], [2, [2, 0, 0], { object: 4, point: [1, 0, 0] }]);
  assert.deepEqual(row.impulse.map((x) => x + 0), [0, 0, -3]);
  assert.deepEqual(row.normal, [0, 0, 1]);
  assert.deepEqual(rows.rows({ ...contact, first: still('c'), second: still('d') }), []);
  // The client for Node refuses rows with other names.
  const [silent] = rows.rows({ ...contact, first: still('a'), second: { key: 'c', massKg: 2 } });
  assert.deepEqual([silent.object, silent.striker], [4, { striker: '', strikerMassKg: 2 }]);
  const [fixed] = rows.rows({ ...contact, first: still('a'), second: still('c') });
  assert.deepEqual(fixed.striker, { striker: '', strikerMassKg: 1e6, strikerRadiusM: 1 });
});

test('velocities alone give the impulse of a collision', () => {
  const contacts = new VelocityContacts();
  contacts.addObject('a', 1);
  const collision = { first: moving('a', 2, [0, 0, -3]), second: still('floor'), point: [0, 0, 0], normal: [0, 0, 1],
    restitution: 0.5 };
  assert.deepEqual(contacts.contacts([collision])[0].impulse, [0, 0, 9]);
  const apart = { ...collision, first: moving('a', 2, [0, 0, 3]) };
  assert.deepEqual(contacts.contacts([apart]), []);
});

test('friction of velocities alone is no greater than what stops the slip', () => {
  const contacts = new VelocityContacts();
  contacts.addObject('a', 1);
  const collision = { first: moving('a', 2, [0.1, 0, -3]), second: still('floor'), point: [0, 0, 0], normal: [0, 0, 1],
    friction: 0.5 };
  near(contacts.contacts([collision])[0].impulse[0], -0.2, 1e-12);
});

/** A box of 2 kg that slides over a floor in Rapier. */
async function slidingInRapier() {
  await rapier.init();
  const world = new rapier.World({ x: 0, y: 0, z: -9.81 });
  world.timestep = STEP_S;
  world.createCollider(rapier.ColliderDesc.cuboid(10, 10, 0.5).setTranslation(0, 0, -0.5).setFriction(0.2));
  const body = world.createRigidBody(rapier.RigidBodyDesc.dynamic().setTranslation(0, 0, 0.015).setLinvel(2, 0, 0)
    .setCanSleep(false));
  world.createCollider(rapier.ColliderDesc.cuboid(0.1, 0.07, 0.015).setMass(2).setFriction(0.2), body);
  return { world, body };
}

test('the impulses read out of Rapier are the change of momentum, friction included', async () => {
  const { world, body } = await slidingInRapier();
  const contacts = new RapierContacts({ roughness: { depth: 0.5 } });
  contacts.addObject(body, 1);
  for (let i = 0; i < 60; i += 1) {
    const before = body.linvel();
    world.step();
    const [x, , z] = sum(contacts.read(world).contacts);
    const after = body.linvel();
    near(x, 2 * (after.x - before.x), 1e-4);
    near(z, 2 * (after.z - before.z + 9.81 * STEP_S), 1e-4);
    assert.ok(i < 5 || x < -0.01); // it slides
  }
  const { contacts: [contact], poses } = contacts.read(world);
  near(contact.roughness.travelSpeedMPerS, body.linvel().x, 0.01);
  near(contact.point[2], 0, 0.002);
  near(poses.positions[0][0], body.translation().x, 1e-6);
});

test('a body that was removed from Rapier sounds no more, whether the adapter was told or not', async () => {
  for (const tell of [true, false]) {
    const { world, body } = await slidingInRapier();
    const contacts = new RapierContacts({ roughness: { depth: 0.5 } });
    const other = world.createRigidBody(rapier.RigidBodyDesc.dynamic().setTranslation(0, 0, 0.045));
    world.createCollider(rapier.ColliderDesc.cuboid(0.1, 0.07, 0.015).setMass(2), other);
    contacts.addObject(body, 1);
    contacts.addObject(other, 2);
    for (let i = 0; i < 20; i += 1) {
      world.step();
      contacts.read(world);
    }
    if (tell) contacts.removeObject(body);
    world.removeRigidBody(body);
    contacts.read(world); // its colliders are in the world's pairs until the next step
    for (let i = 0; i < 60; i += 1) {
      world.step();
      const read = contacts.read(world);
      assert.deepEqual(read.poses.objects, [2]);
      assert.ok(read.contacts.every(({ object, second }) => object === 2 && !second));
    }
    // Rapier gives another body the place of the removed one, which is another body to the adapter.
    const third = world.createRigidBody(rapier.RigidBodyDesc.dynamic().setTranslation(0, 0, 0.4));
    world.createCollider(rapier.ColliderDesc.cuboid(0.1, 0.07, 0.015).setMass(2), third);
    contacts.addObject(third, 1);
    let struck = 0;
    for (let i = 0; i < 120; i += 1) {
      world.step();
      struck = Math.max(struck, ...contacts.read(world).contacts.map(({ impulse }) => Math.abs(impulse[2])));
    }
    assert.ok(struck > 1);
    world.free();
  }
});

test('a partner that is removed loses its number, and no other body has had it', () => {
  const rows = new ContactRows();
  rows.addObject('a', 4);
  const partners = (...keys) => keys.map((key) => rows.rows({ first: still('a'), second: still(key), point: [0, 0, 0],
    normal: [0, 0, 1], impulse: [0, 0, 3] })[0].partner);
  assert.deepEqual(partners('b', 'c', 'b'), [0, 1, 0]);
  rows.removeObject('b');
  assert.deepEqual(partners('c', 'd', 'b'), [1, 2, 3]);
});

test('the impulses read out of Havok are the change of momentum, without those that have finished', async () => {
  const fall = await engines.havok(STEP_S);
  fall.turn([0.3, 0.2, 0]);
  let [most, owed] = [0, 0];
  for (let i = 0; i < 150; i += 1) {
    const before = fall.momentum()[2];
    const along = sum(fall.step().contacts)[2];
    owed += fall.momentum()[2] - before + MASS_KG * GRAVITY_M_PER_S2 * STEP_S - along;
    most = Math.max(most, along);
    if (fall.contacts.unfinished.length) continue; // Havok's next step finishes the blow.
    near(owed, 0, 0.02);
    owed = 0;
  }
  assert.ok(most > 0.5); // it has struck
  fall.remove();
  for (let i = 0; i < 3; i += 1) {
    const { contacts: rows, poses } = fall.step();
    assert.deepEqual([rows, poses.objects], [[], []]);
  }
});

/** Contacts of a body of 2 kg, which an event of Havok presses up along z. `velocity` is that after the step. */
function pressedInHavok(settings) {
  const contacts = new HavokContacts({}, settings);
  contacts.contactRows.addObject(7n, 1);
  contacts.before.set(7n, moving(7n, 2, [0, 0, -1]));
  contacts.poseOf = () => [[0, 0, 0], [1, 0, 0, 0]];
  contacts.posesBefore.set(7n, contacts.poseOf());
  const side = (key, z) => [[key], [0n], [0, 0], [0, 0, 0], [0, 0, z], -1];
  return (velocity, ...events) => {
    contacts.bodyOf = ([key]) => (key === 7n ? moving(7n, 2, [0, 0, velocity]) : still(key));
    contacts.events = () => events.map((event) => ({ pair: '7 8', one: side(7n, -1), other: side(8n, 1), ...event }));
    return contacts.read([0n], STEP_S).contacts;
  };
}

test('a collision that Havok reports without an impulse gets one from the velocities before it', () => {
  const step = pressedInHavok({ restitution: 0.5 });
  const event = { began: true, impulse: 0 };
  const found = step(0.5, event, event);
  assert.equal(found.length, 1); // once for all points of the pair
  near(found[0].impulse[2], 3, 1e-12);
});

test('a blow that Havok divides between two steps is one impulse', () => {
  const step = pressedInHavok();
  assert.deepEqual(step(-0.2, { began: true, impulse: 1.6 }), []); // still approaches
  const [whole] = step(0, { began: false, impulse: 0.4 });
  near(whole.impulse[2], 2, 1e-12);
  near(step(0, { began: false, impulse: 0.1 })[0].impulse[2], 0.1, 1e-12);
});

test('a blow that Havok has finished within a step does not wait, and none that has begun is lost', () => {
  const step = pressedInHavok();
  near(step(0, { began: true, impulse: 2 })[0].impulse[2], 2, 1e-12);
  assert.deepEqual(step(-0.2, { began: true, impulse: 1.6 }), []);
  near(step(-0.2)[0].impulse[2], 1.6, 1e-12);
});

for (const name of ['cannon', 'jolt', 'mujoco', 'physx']) {
  test(`the impulses read out of ${name} are the change of momentum at 60, 240 and 1000 Hz`, async () => {
    for (const rate of [60, 240, 1000]) {
      const fall = await engines[name](1 / rate);
      for (let i = 0; i < rate; i += 1) {
        const before = fall.momentum();
        const told = sum(fall.step().contacts);
        const gained = fall.momentum().map((x, axis) => x - before[axis]);
        gained[2] += MASS_KG * GRAVITY_M_PER_S2 / rate;
        // Jolt's velocities are balanced at the corners, whose friction leaves some of the turning: 2 % of the fall.
        told.forEach((x, axis) => near(x, gained[axis], 0.05));
      }
    }
  });
}

test('a fall is as strong in each engine at each rate, and rests with its weight until it is removed', async () => {
  const falls = [];
  for (const [name, start] of Object.entries(engines)) {
    for (const rate of [60, 240, 1000]) {
      const fall = await start(1 / rate);
      const steps = Array.from({ length: 1.2 * rate }, () => fall.step());
      const told = steps.map(({ contacts }) => sum(contacts)[2]);
      // By the poses that are sent with them, the first contacts are at the corners, which travel 8 mm in a step.
      const { contacts, poses } = steps.find((step) => step.contacts.length > 0);
      for (const { point } of contacts) {
        point.slice(0, 2).forEach((x, axis) => near(Math.abs(x - poses.positions[0][axis]), HALF_M[axis], 0.002));
      }
      const from = told.findIndex((x) => x > 0);
      const within = (begin, end) => told.slice(begin, end).reduce((total, x) => total + x, 0);
      falls.push([name, rate, within(from, from + 0.05 * rate)]);
      near(within(0.8 * rate, 1.2 * rate) / (0.4 * MASS_KG * GRAVITY_M_PER_S2), 1, 0.04);
      fall.remove();
      for (let i = 0; i < 3; i += 1) assert.deepEqual(fall.step().contacts, []);
    }
  }
  const median = falls.map(([, , impulse]) => impulse).sort((a, b) => a - b)[falls.length >> 1];
  // 2.8 N s, and the weight for 50 ms.
  const speed = Math.sqrt(2 * GRAVITY_M_PER_S2 * (HEIGHT_M - HALF_M[2]));
  near(median, MASS_KG * (speed + 0.05 * GRAVITY_M_PER_S2), 0.3);
  for (const [name, rate, impulse] of falls) {
    assert.ok(Math.abs(20 * Math.log10(impulse / median)) < 3, `${name} ${rate} ${impulse} ${median}`);
  }
});
