// SPDX-License-Identifier: Apache-2.0
'use strict';

// The same box falls on a floor in each engine for JavaScript, and slides. Each of `engines` starts a fall with
// steps of a length and an orientation of the box, [w, x, y, z]. A fall has step(), what a step of a stream or trace
// takes, and momentum(), of the box.
const fs = require('node:fs');
const path = require('node:path');
const { pathToFileURL } = require('node:url');

const adapters = path.resolve(__dirname, '../../../client_sdk/adapters');
const MASS_KG = 1.21; // of hollow concrete with a wall of 6 mm
const HALF_M = [0.1, 0.07, 0.03];
const FLOOR_HALF_M = [5, 5, 0.5];
const FLOOR_AT_M = [0, 0, -0.5];
const HEIGHT_M = 0.3; // of the middle
const SPEED_M_PER_S = [0.5, 0, 0];
const GRAVITY_M_PER_S2 = 9.81;
const FRICTION = 0.5;
const FLAT = [1, 0, 0, 0];

const adapter = (name, type) => require(path.join(adapters, name))[type];
const imported = async (name) => (await import(pathToFileURL(require.resolve(name)))).default;
const momentum = ({ x, y, z }) => [x, y, z].map((speed) => MASS_KG * speed);

async function rapier(stepS, [w, x, y, z] = FLAT) {
  const engine = require('@dimforge/rapier3d-compat');
  await engine.init();
  const world = new engine.World({ x: 0, y: 0, z: -GRAVITY_M_PER_S2 });
  world.timestep = stepS;
  world.lengthUnit = 0.1;
  world.createCollider(engine.ColliderDesc.cuboid(...FLOOR_HALF_M).setTranslation(...FLOOR_AT_M).setFriction(FRICTION));
  const body = world.createRigidBody(engine.RigidBodyDesc.dynamic().setTranslation(0, 0, HEIGHT_M)
    .setRotation({ w, x, y, z }).setLinvel(...SPEED_M_PER_S).setCanSleep(false));
  world.createCollider(engine.ColliderDesc.cuboid(...HALF_M).setMass(MASS_KG).setFriction(FRICTION), body);
  const contacts = new (adapter('rapier_contacts', 'RapierContacts'))();
  contacts.addObject(body, 1);
  const step = () => {
    world.step();
    return contacts.read(world);
  };
  return { step, momentum: () => momentum(body.linvel()), remove: () => world.removeRigidBody(body) };
}

async function havok(stepS, [w, x, y, z] = FLAT) {
  const wasmBinary = fs.readFileSync(require.resolve('@babylonjs/havok/lib/umd/HavokPhysics.wasm'));
  const engine = await require('@babylonjs/havok')({ wasmBinary });
  const Contacts = adapter('havok_contacts', 'HavokContacts');
  const [, world] = engine.HP_World_Create();
  const gravity = [0, 0, -GRAVITY_M_PER_S2];
  engine.HP_World_SetGravity(world, gravity);
  const add = (motion, half, position, turn) => {
    const corners = [-1, 1].flatMap((a) => [-1, 1].flatMap((b) => [-1, 1].flatMap((c) =>
      [a * half[0], b * half[1], c * half[2]])));
    const address = engine._malloc(4 * corners.length);
    engine.HEAPF32.set(corners, address / 4);
    const [, shape] = engine.HP_Shape_CreateConvexHull(address, corners.length / 3);
    engine._free(address);
    const [, body] = engine.HP_Body_Create();
    engine.HP_Shape_SetMaterial(shape, [FRICTION, FRICTION, 0, engine.MaterialCombine.MAXIMUM,
      engine.MaterialCombine.MAXIMUM]);
    engine.HP_Body_SetShape(body, shape);
    engine.HP_Body_SetMotionType(body, motion);
    engine.HP_Body_SetQTransform(body, [position, turn]);
    engine.HP_Body_SetMassProperties(body, [[0, 0, 0], MASS_KG, [0.00234, 0.0044, 0.00601], [0, 0, 0, 1]]);
    // Those that have finished, too, which the adapter must leave out.
    engine.HP_Body_SetEventMask(body, Contacts.eventMask(engine) | engine.EventType.COLLISION_FINISHED.value);
    engine.HP_Body_SetLinearDamping(body, 0);
    engine.HP_Body_SetActivationControl(body, engine.ActivationControl.ALWAYS_ACTIVE);
    engine.HP_World_AddBody(world, body, false);
    return body;
  };
  add(engine.MotionType.STATIC, FLOOR_HALF_M, FLOOR_AT_M, [0, 0, 0, 1]);
  const body = add(engine.MotionType.DYNAMIC, HALF_M, [0, 0, HEIGHT_M], [x, y, z, w]);
  engine.HP_Body_SetLinearVelocity(body, SPEED_M_PER_S);
  const contacts = new Contacts(engine, { gravity, friction: FRICTION });
  contacts.addObject(body, 1);
  const step = () => {
    engine.HP_World_Step(world, stepS);
    return contacts.read(world, stepS);
  };
  const remove = () => {
    contacts.removeObject(body);
    engine.HP_World_RemoveBody(world, body);
    engine.HP_Body_Release(body);
  };
  const turn = (speed) => engine.HP_Body_SetAngularVelocity(body, speed);
  return { step, remove, turn, contacts,
    momentum: () => engine.HP_Body_GetLinearVelocity(body)[1].map((speed) => MASS_KG * speed) };
}

async function cannon(stepS, [w, x, y, z] = FLAT) {
  const engine = require('cannon-es');
  const world = new engine.World({ gravity: new engine.Vec3(0, 0, -GRAVITY_M_PER_S2) });
  Object.assign(world.defaultContactMaterial, { friction: FRICTION, restitution: 0 });
  const add = (half, at, mass) => {
    const body = new engine.Body({ mass, position: new engine.Vec3(...at), linearDamping: 0, angularDamping: 0 });
    body.addShape(new engine.Box(new engine.Vec3(...half)));
    world.addBody(body);
    return body;
  };
  add(FLOOR_HALF_M, FLOOR_AT_M, 0);
  const body = add(HALF_M, [0, 0, HEIGHT_M], MASS_KG);
  body.quaternion.set(x, y, z, w);
  body.velocity.set(...SPEED_M_PER_S);
  const contacts = new (adapter('cannon_contacts', 'CannonContacts'))();
  contacts.addObject(body, 1);
  const step = () => {
    world.step(stepS);
    return contacts.read(world);
  };
  return { step, momentum: () => momentum(body.velocity), remove: () => world.removeBody(body) };
}

async function jolt(stepS, [w, x, y, z] = FLAT) {
  const engine = await (await imported('jolt-physics'))();
  const settings = new engine.JoltSettings();
  settings.mMaxWorkerThreads = 0;
  const pairs = new engine.ObjectLayerPairFilterTable(2);
  pairs.EnableCollision(0, 1);
  const layers = new engine.BroadPhaseLayerInterfaceTable(2, 2);
  for (const layer of [0, 1]) layers.MapObjectToBroadPhaseLayer(layer, new engine.BroadPhaseLayer(layer));
  settings.mObjectLayerPairFilter = pairs;
  settings.mBroadPhaseLayerInterface = layers;
  settings.mObjectVsBroadPhaseLayerFilter = new engine.ObjectVsBroadPhaseLayerFilterTable(layers, 2, pairs, 2);
  const world = new engine.JoltInterface(settings);
  const system = world.GetPhysicsSystem();
  const bodies = system.GetBodyInterface();
  system.SetGravity(new engine.Vec3(0, 0, -GRAVITY_M_PER_S2));
  const add = (half, at, turn, motion, layer) => {
    const creation = new engine.BodyCreationSettings(new engine.BoxShape(new engine.Vec3(...half), 0.001),
      new engine.RVec3(...at), new engine.Quat(...turn), motion, layer);
    Object.assign(creation, { mAllowSleeping: false, mFriction: FRICTION, mLinearDamping: 0, mAngularDamping: 0 });
    creation.mOverrideMassProperties = engine.EOverrideMassProperties_CalculateInertia;
    creation.mMassPropertiesOverride.mMass = MASS_KG;
    const body = bodies.CreateBody(creation);
    bodies.AddBody(body.GetID(), engine.EActivation_Activate);
    return body;
  };
  add(FLOOR_HALF_M, FLOOR_AT_M, [0, 0, 0, 1], engine.EMotionType_Static, 0);
  const body = add(HALF_M, [0, 0, HEIGHT_M], [x, y, z, w], engine.EMotionType_Dynamic, 1);
  body.SetLinearVelocity(new engine.Vec3(...SPEED_M_PER_S));
  const contacts = new (adapter('jolt_contacts', 'JoltContacts'))(engine, system);
  contacts.addObject(body, 1);
  const step = () => {
    world.Step(stepS, 1);
    return contacts.read(stepS);
  };
  const remove = () => {
    contacts.removeObject(body);
    bodies.RemoveBody(body.GetID());
    bodies.DestroyBody(body.GetID());
  };
  const speed = () => body.GetLinearVelocity();
  return { step, remove, momentum: () => momentum({ x: speed().GetX(), y: speed().GetY(), z: speed().GetZ() }) };
}

async function mujoco(stepS, [w, x, y, z] = FLAT) {
  const engine = await (await imported('mujoco-js'))();
  engine.FS.mkdir('/drop');
  engine.FS.mount(engine.MEMFS, { root: '.' }, '/drop');
  engine.FS.writeFile('/drop/drop.xml', `<mujoco><option timestep="${stepS}" gravity="0 0 -${GRAVITY_M_PER_S2}"/>
    <default><geom friction="${FRICTION}"/></default>
    <worldbody><geom type="box" size="${FLOOR_HALF_M.join(' ')}" pos="${FLOOR_AT_M.join(' ')}"/>
    <body pos="0 0 ${HEIGHT_M}" quat="${w} ${x} ${y} ${z}"><joint type="free"/>
    <geom type="box" size="${HALF_M.join(' ')}" mass="${MASS_KG}"/></body>
    </worldbody></mujoco>`);
  const model = engine.MjModel.loadFromXML('/drop/drop.xml');
  const data = new engine.MjData(model);
  SPEED_M_PER_S.forEach((speed, axis) => { data.qvel[axis] = speed; });
  const contacts = new (adapter('mujoco_contacts', 'MujocoContacts'))(model);
  contacts.addObject(1, 1);
  const step = () => {
    engine.mj_step(model, data);
    return contacts.read(data);
  };
  return { step, momentum: () => Array.from(data.qvel.subarray(0, 3), (speed) => MASS_KG * speed),
    remove: () => contacts.removeObject(1) };
}

/** PhysX is compiled for browsers, and refuses where it sees Node. */
async function physxModule() {
  const file = require.resolve('physx-js-webidl');
  const wasmBinary = fs.readFileSync(file.replace('.mjs', '.wasm'));
  const start = await imported('physx-js-webidl');
  const { process } = globalThis;
  globalThis.process = undefined;
  globalThis.WorkerGlobalScope ??= class {};
  globalThis.self ??= { location: { href: '' } };
  try {
    return await start({ wasmBinary });
  } finally {
    globalThis.process = process;
  }
}

let loadedPhysx;
async function physx(stepS, [w, x, y, z] = FLAT) {
  loadedPhysx ??= physxModule().then((engine) => {
    const foundation = engine.CreateFoundation(engine.PHYSICS_VERSION, new engine.PxDefaultAllocator(),
      new engine.PxDefaultErrorCallback());
    const tolerances = new engine.PxTolerancesScale();
    return { engine, tolerances, physics: engine.CreatePhysics(engine.PHYSICS_VERSION, foundation, tolerances) };
  });
  const { engine, tolerances, physics } = await loadedPhysx;
  const Contacts = adapter('physx_contacts', 'PhysxContacts');
  const contacts = new Contacts(engine, { friction: FRICTION });
  const description = new engine.PxSceneDesc(tolerances);
  Object.assign(description, { gravity: new engine.PxVec3(0, 0, -GRAVITY_M_PER_S2),
    cpuDispatcher: engine.DefaultCpuDispatcherCreate(0), filterShader: engine.DefaultFilterShader(),
    simulationEventCallback: contacts.callback });
  const scene = physics.createScene(description);
  const material = physics.createMaterial(FRICTION, FRICTION, 0);
  const add = (half, at, turn, create) => {
    const shape = physics.createShape(new engine.PxBoxGeometry(...half), material, true,
      new engine.PxShapeFlags(engine.PxShapeFlagEnum.eSIMULATION_SHAPE));
    shape.setSimulationFilterData(new engine.PxFilterData(1, 1, Contacts.pairFlags(engine), 0));
    const body = physics[create](new engine.PxTransform(new engine.PxVec3(...at), new engine.PxQuat(...turn)));
    body.attachShape(shape);
    scene.addActor(body);
    return body;
  };
  add(FLOOR_HALF_M, FLOOR_AT_M, [0, 0, 0, 1], 'createRigidStatic');
  const body = add(HALF_M, [0, 0, HEIGHT_M], [x, y, z, w], 'createRigidDynamic');
  engine.PxRigidBodyExt.prototype.setMassAndUpdateInertia(body, MASS_KG);
  body.setLinearDamping(0);
  body.setAngularDamping(0);
  body.setSleepThreshold(0);
  body.setLinearVelocity(new engine.PxVec3(...SPEED_M_PER_S));
  contacts.addObject(body, 1);
  const step = () => {
    scene.simulate(stepS);
    scene.fetchResults(true);
    return contacts.read(stepS, [0, 0, -GRAVITY_M_PER_S2]);
  };
  const remove = () => {
    contacts.removeObject(body);
    scene.removeActor(body);
    body.release();
  };
  return { step, remove, momentum: () => momentum(body.getLinearVelocity()) };
}

module.exports = { GRAVITY_M_PER_S2, MASS_KG, HEIGHT_M, HALF_M,
  engines: { rapier, havok, cannon, jolt, mujoco, physx } };
