// SPDX-License-Identifier: Apache-2.0
// Thirty bars fall in Rapier, are drawn by three.js, and are heard through the console. The lines that concern sound
// name carillon, scene or contacts.
import RAPIER from '@dimforge/rapier3d-compat';
import * as THREE from 'three';
import { RapierContacts } from 'carillon/adapters/rapier_contacts';
import { Carillon } from '@carillon/web';

const SIZE_M = [0.2, 0.016, 0.01];
const STEP_S = 1 / 60;
const MATERIALS = ['structural_steel', 'chime_aluminum', 'soda_lime_glass'];

/** A box about the origin, as an OBJ file. */
function boxObj([x, y, z]) {
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => `v ${(i & 1 ? x : -x) / 2} ${(i & 2 ? y : -y) / 2} ${(i & 4 ? z : -z) / 2}`);
  const faces = ['1 3 4 2', '5 6 8 7', '1 2 6 5', '3 7 8 4', '1 5 7 3', '2 4 8 6'].map((face) => `f ${face}`);
  return [...corners, ...faces, ''].join('\n');
}

async function main() {
  await RAPIER.init();
  const world = new RAPIER.World({ x: 0, y: -9.81, z: 0 });
  world.timestep = STEP_S;
  world.lengthUnit = 0.1;
  world.createCollider(RAPIER.ColliderDesc.cuboid(5, 0.5, 5).setTranslation(0, -0.5, 0));

  const carillon = await Carillon.connect();
  addEventListener('pointerdown', () => carillon.play(), { once: true });
  const models = await Promise.all(MATERIALS.map((material) => carillon.model(boxObj(SIZE_M), 'obj', material, 'bar')));
  const scene = await carillon.scene(STEP_S);
  const contacts = new RapierContacts();
  const bodies = [];
  for (let i = 0; i < 30; i += 1) {
    const body = world.createRigidBody(RAPIER.RigidBodyDesc.dynamic()
      .setTranslation(0.25 * (i % 5) - 0.5, 0.4 + 0.15 * i, 0.1 * ((i * 7) % 4)).setRotation({ x: 0, y: Math.sin(i), z: 0, w: Math.cos(i) }));
    const [x, y, z] = SIZE_M.map((side) => side / 2);
    world.createCollider(RAPIER.ColliderDesc.cuboid(x, y, z).setDensity(7850).setRestitution(0.3), body);
    const [handle] = await scene.add({ modalModel: models[i % models.length] });
    contacts.addObject(body, handle);
    bodies.push(body);
  }

  const picture = new Picture(bodies);
  let time = 0;
  let before = performance.now();
  let owed = 0;
  setInterval(() => {
    // What a busy machine does not simulate in time is left out.
    owed = Math.min(owed + (performance.now() - before) / 1000, 5 * STEP_S);
    before = performance.now();
    for (; owed > STEP_S; owed -= STEP_S) {
      world.step();
      time += STEP_S;
      scene.step(time, contacts.read(world));
    }
    picture.draw();
  }, 1000 * STEP_S);
  globalThis.example = { carillon, scene, bodies };
}

class Picture {
  constructor(bodies) {
    this.bodies = bodies;
    this.renderer = new THREE.WebGLRenderer({ canvas: document.querySelector('canvas'), antialias: true, preserveDrawingBuffer: true });
    this.renderer.setSize(innerWidth, innerHeight, false);
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(0xf4f4f0);
    this.camera = new THREE.PerspectiveCamera(45, innerWidth / innerHeight, 0.01, 100);
    this.camera.position.set(0.9, 0.8, 1.6);
    this.camera.lookAt(0, 0.2, 0.1);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x777788, 3));
    const box = new THREE.BoxGeometry(...SIZE_M);
    const colors = [0x7a8590, 0xc9c9c9, 0x5aa9a0];
    this.meshes = bodies.map((_, i) => new THREE.Mesh(box, new THREE.MeshStandardMaterial({ color: colors[i % 3] })));
    this.scene.add(...this.meshes);
  }

  draw() {
    this.meshes.forEach((mesh, i) => {
      mesh.position.copy(this.bodies[i].translation());
      mesh.quaternion.copy(this.bodies[i].rotation());
    });
    this.renderer.render(this.scene, this.camera);
  }
}

main();
