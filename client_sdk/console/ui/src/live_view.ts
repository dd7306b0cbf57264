// SPDX-License-Identifier: Apache-2.0
// The bodies of a scene at their poses, blows as dots, and the listener with its ears.
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { DrawBudget } from './draw_budget';
import type { Scene, SoundingObject } from './gen/carillon/v1/scene_service_pb';
import type { Pose } from './gen/carillon/v1/contact_pb';
import type { SeenBlow } from './live_state';
import type { Surface } from './modal_model';

/** Colours that the colour-blind tell apart (Okabe and Ito). */
const COLORS = [0x0072b2, 0xe69f00, 0x009e73, 0xcc79a7, 0x56b4e9, 0xd55e00, 0xf0e442, 0x999999];
/** The colour of the body of a handle, as CSS has it. */
export const colorOf = (handle: number) => `#${COLORS[handle % COLORS.length]!.toString(16).padStart(6, '0')}`;
const BLOW_MS = 700;
const GLOW_MS = 250;
export const MOST_DOTS = 24;

export type SurfaceOf = (modalModel: string) => Promise<Pick<Surface, 'vertices' | 'triangles'>>;

interface Shown {
  mesh: THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>;
  struckMs: number;
  hasPose: boolean;
}

export class LiveView {
  private readonly renderer: THREE.WebGLRenderer;
  private readonly budget: DrawBudget;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(40, 1, 1e-3, 1e4);
  private readonly controls: OrbitControls;
  private readonly surfaces = new Map<string, ReturnType<SurfaceOf>>();
  private readonly shown = new Map<number, Shown>();
  private readonly dots = new THREE.Group();
  private readonly ball = new THREE.SphereGeometry(1, 12, 8);
  private readonly listener = this.makeListener();
  private sceneName = '';
  private extent = 0;
  private drawnState = '';
  /** Whether a pose, a body or the size has changed since the last picture. */
  private dirty = true;

  constructor(private readonly canvas: HTMLCanvasElement, private readonly surfaceOf: SurfaceOf) {
    this.renderer = new THREE.WebGLRenderer({ canvas, alpha: true, antialias: true, preserveDrawingBuffer: true });
    this.budget = new DrawBudget(this.renderer);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.zoomToCursor = true;
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    this.camera.add(sun);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x777788, 2), this.camera, this.dots, this.listener);
    new ResizeObserver(() => this.fit()).observe(canvas);
    this.renderer.setAnimationLoop(() => this.draw());
  }

  /** Shows a scene; bodies of other scenes go. */
  async update(scene: Scene | undefined, objects: SoundingObject[]): Promise<void> {
    if (scene?.name !== this.sceneName) this.clear(scene?.name ?? '');
    const here = objects.filter((object) => object.name.startsWith(`${this.sceneName}/`));
    const handles = new Set(here.map((object) => object.handle));
    for (const [handle, { mesh }] of this.shown) {
      if (handles.has(handle)) continue;
      this.scene.remove(mesh);
      this.shown.delete(handle);
    }
    await Promise.all(here.map((object) => this.place(object)));
    const { distanceGain, propagationDelay, panning, directivity, binaural } = scene?.hearing ?? {};
    this.listener.visible = Boolean(distanceGain || propagationDelay || panning || directivity || binaural);
    if (scene?.listener) setPose(this.listener, scene.listener);
    this.layOut();
    const state = JSON.stringify([this.sceneName, scene?.listener, here.map(({ handle, size, pose }) => [handle, size, pose])]);
    this.dirty ||= state !== this.drawnState;
    this.drawnState = state;
  }

  blow({ blow, seenMs }: Pick<SeenBlow, 'blow' | 'seenMs'>): void {
    const struck = this.shown.get(blow.object);
    if (!struck || !blow.pointM) return;
    struck.struckMs = performance.now();
    const dot = new THREE.Mesh(this.ball, new THREE.MeshBasicMaterial({ color: 0xd43d00, transparent: true, depthTest: false }));
    const { x, y, z } = blow.impulseNewtonSeconds ?? { x: 0, y: 0, z: 0 };
    // A hundred times the impulse is a dot about five times as wide.
    const size = Math.min(4, Math.max(0.5, Math.cbrt(Math.hypot(x, y, z) / 0.01)));
    dot.scale.setScalar(0.008 * Math.max(this.extent, 1e-3) * size);
    dot.position.copy(struck.mesh.localToWorld(new THREE.Vector3(blow.pointM.x, blow.pointM.y, blow.pointM.z).divide(struck.mesh.scale)));
    dot.userData.bornMs = performance.now() - (Date.now() - seenMs);
    this.dots.add(dot);
    // What cannot be drawn in time is left out, not piled up.
    if (this.dots.children.length > MOST_DOTS) this.dots.remove(this.dots.children[0]!);
  }

  private clear(name: string): void {
    for (const { mesh } of this.shown.values()) this.scene.remove(mesh);
    this.shown.clear();
    this.dots.clear();
    this.sceneName = name;
    this.extent = 0;
  }

  private async place(object: SoundingObject): Promise<void> {
    if (!this.surfaces.has(object.modalModel)) this.surfaces.set(object.modalModel, this.surfaceOf(object.modalModel));
    const name = this.sceneName;
    const surface = await this.surfaces.get(object.modalModel)!.catch(() => undefined);
    if (!surface || name !== this.sceneName) return;
    let body = this.shown.get(object.handle);
    if (!body) {
      const color = COLORS[object.handle % COLORS.length]!;
      const geometry = new THREE.BufferGeometry();
      geometry.setIndex(new THREE.BufferAttribute(surface.triangles, 1));
      geometry.setAttribute('position', new THREE.BufferAttribute(surface.vertices, 3));
      body = { mesh: new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ color, flatShading: true, roughness: 0.7, emissive: color, emissiveIntensity: 0 })),
        struckMs: -Infinity, hasPose: false };
      this.shown.set(object.handle, body);
      this.scene.add(body.mesh);
    }
    body.mesh.scale.setScalar(object.size || 1);
    body.hasPose = object.pose !== undefined;
    if (object.pose) setPose(body.mesh, object.pose);
    body.mesh.updateMatrixWorld();
  }

  /** Puts bodies whose simulator sends no poses in a row, and looks at all once. */
  private layOut(): void {
    let x = 0;
    for (const { mesh, hasPose } of this.shown.values()) {
      if (hasPose) continue;
      mesh.geometry.computeBoundingBox();
      const box = mesh.geometry.boundingBox!;
      mesh.position.set(x - box.min.x * mesh.scale.x, 0, 0);
      x += 1.2 * (box.max.x - box.min.x) * mesh.scale.x;
    }
    const all = new THREE.Box3();
    for (const { mesh } of this.shown.values()) all.expandByObject(mesh);
    const extent = all.isEmpty() ? 0 : all.getSize(new THREE.Vector3()).length();
    if (extent < 1.5 * this.extent || extent === 0) return;
    this.extent = extent;
    all.getCenter(this.controls.target);
    this.camera.position.copy(this.controls.target).add(new THREE.Vector3(0.5, 0.5, 1).multiplyScalar(1.3 * extent));
    this.camera.near = extent / 1000;
    this.camera.far = extent * 100;
    this.camera.updateProjectionMatrix();
    this.listener.scale.setScalar(Math.min(1, extent / 2));
  }

  /** A head of 18 cm with a nose and two ears. */
  private makeListener(): THREE.Group {
    const group = new THREE.Group();
    const ball = new THREE.SphereGeometry(1, 16, 12);
    const part = (color: number, size: number, x: number, y: number, z: number) => {
      const mesh = new THREE.Mesh(ball, new THREE.MeshStandardMaterial({ color }));
      mesh.scale.setScalar(size);
      mesh.position.set(x, y, z);
      group.add(mesh);
    };
    part(0xd9b38c, 0.09, 0, 0, 0);
    part(0xd9b38c, 0.02, 0, 0, -0.095);
    part(0xa02c2c, 0.025, -0.09, 0, 0);
    part(0xa02c2c, 0.025, 0.09, 0, 0);
    group.visible = false;
    return group;
  }

  private fit(): void {
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !clientHeight) return;
    this.dirty = true;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
  }

  private draw(): void {
    const now = performance.now();
    if (document.hidden || !this.canvas.clientWidth || !this.budget.mayDraw(now)) return;
    const moved = this.controls.update();
    const glows = [...this.shown.values()].some(({ struckMs }) => now - struckMs < 2 * GLOW_MS);
    if (!this.dirty && !moved && !glows && !this.dots.children.length) return;
    this.dirty = false;
    for (const dot of [...this.dots.children] as THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial>[]) {
      const age = (now - dot.userData.bornMs) / BLOW_MS;
      dot.material.opacity = Math.max(0, 1 - age);
      if (age < 1) continue;
      this.dots.remove(dot);
      dot.material.dispose();
    }
    for (const { mesh, struckMs } of this.shown.values()) mesh.material.emissiveIntensity = Math.max(0, 0.8 * (1 - (now - struckMs) / GLOW_MS));
    this.budget.draw(this.scene, this.camera);
  }
}

function setPose(body: THREE.Object3D, pose: Pose): void {
  const { x, y, z } = pose.positionM ?? { x: 0, y: 0, z: 0 };
  body.position.set(x, y, z);
  if (pose.orientation) body.quaternion.set(pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w);
}
