// SPDX-License-Identifier: Apache-2.0
// The body in 3D: one mode, or a strike in slow motion, as displacement and colour; points are picked on the body at rest.
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { DrawBudget } from './draw_budget';
import type { ModalModel, SoundingMode } from './modal_model';
import { firstHit } from './raycast';

/** The largest displacement, as a share of the body's extent. */
const BEND = 0.05;
/** From what does not move to what moves most (viridis): lightness alone tells them apart, too. */
const RAMP = [0x440154, 0x3b528b, 0x21918c, 0x5ec962, 0xfde725].map((color) => new THREE.Color(color));
const REST_COLOR = new THREE.Color(0x9aa4ad);
const MODES_OF_A_STRIKE = 24;
const MODE_HZ = 1, SLOW_STRIKE_S = 6;

export interface Strike {
  vertex: number;
  point: [number, number, number];
  /** The outward unit normal at the point. */
  normal: [number, number, number];
}

interface Weight { mode: number; amplitude: number; frequencyHz: number; decayPerS: number }

export class BodyView {
  private readonly renderer: THREE.WebGLRenderer;
  private readonly budget: DrawBudget;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(40, 1, 1e-4, 1e4);
  private readonly controls: OrbitControls;
  private readonly dot = new THREE.Mesh(new THREE.SphereGeometry(1, 16, 12), new THREE.MeshBasicMaterial({ color: 0xd43d00, depthTest: false }));
  /** The strike whose point the dot shows. */
  private marked?: Strike;
  private model?: ModalModel;
  private readonly marks = new THREE.Group();
  private body?: THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>;
  private extent = 1;
  private weights: Weight[] = [];
  /** The newest animation that was asked for; its shapes may still be on the way. */
  private wanted = {};
  private largest = 1;
  private slowness = 1;
  private begin = 0;
  private readonly still = matchMedia('(prefers-reduced-motion: reduce)').matches;
  /** Whether something but the camera and the animation has changed since the last picture. */
  private dirty = true;
  paused = false;

  constructor(private readonly canvas: HTMLCanvasElement, private readonly struck: (strike: Strike) => void) {
    this.renderer = new THREE.WebGLRenderer({ canvas, alpha: true, antialias: true, preserveDrawingBuffer: true });
    this.budget = new DrawBudget(this.renderer);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.zoomToCursor = true;
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x777788, 2.2), this.dot, this.marks);
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    this.camera.add(sun);
    this.scene.add(this.camera);
    this.dot.visible = false;
    this.dot.renderOrder = 1;  // above the body, which may swing over it
    this.pickByClick();
    new ResizeObserver(() => this.fit()).observe(canvas);
    this.renderer.setAnimationLoop((now) => this.draw(now));
  }

  /** Shows the surface of a file that is no model yet, if it is known, with the places that a refusal names. */
  preview(surface: THREE.BufferGeometry | undefined, metresPerUnit: number, places: [number, number, number][]): void {
    this.clear();
    this.dot.visible = false;
    if (!surface) {
      this.budget.draw(this.scene, this.camera);
      return;
    }
    surface = surface.clone().scale(metresPerUnit, metresPerUnit, metresPerUnit);
    this.body = new THREE.Mesh(surface, new THREE.MeshStandardMaterial({ color: 0x9aa4ad, flatShading: true, side: THREE.DoubleSide }));
    this.scene.add(this.body);
    this.lookAt(surface);
    for (const place of places) {
      const mark = new THREE.Mesh(this.dot.geometry, this.dot.material);
      mark.position.set(...place);
      mark.scale.setScalar(this.extent * 0.02);
      mark.renderOrder = 1;
      this.marks.add(mark);
    }
    if (places.length === 2) {
      const points = places.map((place) => new THREE.Vector3(...place));
      this.marks.add(new THREE.Line(new THREE.BufferGeometry().setFromPoints(points), new THREE.LineBasicMaterial({ color: 0xd43d00 })));
    }
  }

  private clear(): void {
    this.dirty = true;
    if (this.body) this.scene.remove(this.body);
    this.body?.geometry.dispose();
    this.marks.clear();
    this.model = undefined;
    this.weights = [];
    this.wanted = {};
  }

  show(model: ModalModel): void {
    const again = this.model !== undefined && this.model.name === model.name;
    this.clear();
    this.model = model;
    const geometry = new THREE.BufferGeometry();
    geometry.setIndex(new THREE.BufferAttribute(model.triangles, 1));
    geometry.setAttribute('position', new THREE.BufferAttribute(model.vertices.slice(), 3));
    geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(model.vertices.length).fill(0.75), 3));
    this.body = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ vertexColors: true, flatShading: true, roughness: 0.6 }));
    this.scene.add(this.body);
    // The fine model takes the coarse one's place without a jump.
    if (!again) this.lookAt(geometry);
    this.paint();
  }

  /** Shows one mode, in motion. */
  async showMode(mode: SoundingMode): Promise<void> {
    await this.animate([{ mode: mode.index, amplitude: 1, frequencyHz: MODE_HZ, decayPerS: 0 }], 1);
  }

  /** Shows a strike, at a point whose shapes are `row`, as much slower as makes its lowest mode swing once a second. */
  async showStrike(strike: Strike, row: Float32Array, modes: SoundingMode[]): Promise<void> {
    this.mark(strike);
    const loudest = [...modes].sort((a, b) => b.levelPa / b.frequencyHz - a.levelPa / a.frequencyHz).slice(0, MODES_OF_A_STRIKE);
    if (!loudest.length || !this.model) return;
    const sign = (mode: number) => Math.sign(strike.normal.reduce((sum, n, axis) => sum - n * row[3 * mode + axis]!, 0));
    await this.animate(loudest.map((mode) => ({ mode: mode.index, amplitude: sign(mode.index) * mode.levelPa / mode.frequencyHz ** 2,
      frequencyHz: mode.frequencyHz, decayPerS: mode.decayPerS })), Math.min(...loudest.map((mode) => mode.frequencyHz)));
  }

  mark(strike: Strike): void {
    this.marked = strike;
    this.dot.position.set(...strike.point);
    this.dot.scale.setScalar(this.extent * 0.012);
    this.dot.visible = this.dirty = true;
  }

  /** The vertex nearest to a ray through a place of the canvas, -1 to 1 each way. */
  pick(x: number, y: number): Strike | undefined {
    if (!this.model) return undefined;
    const from = this.camera.position;
    this.camera.updateMatrixWorld();
    const direction = new THREE.Vector3(x, y, 0.5).unproject(this.camera).sub(from);
    const hit = firstHit(this.model.vertices, this.model.triangles, from.toArray(), direction.toArray());
    if (!hit) return undefined;
    const point = new THREE.Vector3(...hit.point);
    const vertex = this.corners(hit.triangle).reduce((best, corner) => (this.place(corner).distanceTo(point) < this.place(best).distanceTo(point) ? corner : best));
    return { vertex, point: hit.point, normal: this.normalOf(hit.triangle) };
  }

  /** Where on the canvas a point of the body is, -1 to 1 each way. */
  project(point: Strike['point']): { x: number; y: number } {
    this.camera.updateMatrixWorld();
    const { x, y } = new THREE.Vector3(...point).project(this.camera);
    return { x, y };
  }

  /** The point that is farthest from the body's middle, along the normal there. */
  outermost(): Strike | undefined {
    const center = this.body?.geometry.boundingSphere?.center;
    if (!center || !this.model) return undefined;
    let vertex = 0, farthest = 0;
    for (let i = 0; i < this.model.vertices.length / 3; i += 1) {
      const distance = this.place(i).distanceToSquared(center);
      if (distance > farthest) { farthest = distance; vertex = i; }
    }
    return { vertex, point: this.place(vertex).toArray(), normal: this.normalOf(Math.floor(this.model.triangles.indexOf(vertex) / 3)) };
  }

  /** A vertex of the body at rest. */
  private place(vertex: number): THREE.Vector3 {
    return new THREE.Vector3().fromArray(this.model!.vertices, 3 * vertex);
  }

  private corners(triangle: number): number[] {
    return [...this.model!.triangles.subarray(3 * triangle, 3 * triangle + 3)];
  }

  private normalOf(triangle: number): Strike['normal'] {
    const [a, b, c] = this.corners(triangle).map((corner) => this.place(corner));
    return new THREE.Triangle(a, b, c).getNormal(new THREE.Vector3()).toArray();
  }

  turn(right: number, up: number): void {
    const offset = new THREE.Spherical().setFromVector3(this.camera.position.clone().sub(this.controls.target));
    offset.theta -= right;
    offset.phi = Math.max(0.05, Math.min(Math.PI - 0.05, offset.phi - up));
    this.camera.position.copy(this.controls.target).add(new THREE.Vector3().setFromSpherical(offset));
    this.controls.update();
  }

  private pickByClick(): void {
    let down = { x: 0, y: 0 };
    this.canvas.addEventListener('pointerdown', (event) => { down = { x: event.clientX, y: event.clientY }; });
    this.canvas.addEventListener('pointerup', (event) => {
      if (Math.hypot(event.clientX - down.x, event.clientY - down.y) > 4) return;
      const box = this.canvas.getBoundingClientRect();
      const strike = this.pick(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height);
      if (strike) this.struck(strike);
    });
  }

  private async animate(weights: Weight[], slowness: number): Promise<void> {
    const wanted = this.wanted = {};
    const { model } = this;
    await model!.shapes.fetch(weights.map((weight) => weight.mode));
    if (this.wanted !== wanted || this.model !== model) return;
    this.weights = weights;
    this.slowness = slowness;
    this.begin = performance.now();
    this.largest = Math.max(this.measure(0.25), 1e-30);
    // A mode keeps its colours while it swings, so that its nodal lines stay in sight.
    if (weights.length === 1) this.paint(this.displaced(0.25));
  }

  private measure(time: number): number {
    const moved = this.displaced(time);
    let largest = 0;
    for (let i = 0; i < moved.length; i += 3) largest = Math.max(largest, Math.hypot(moved[i]!, moved[i + 1]!, moved[i + 2]!));
    return largest;
  }

  /** The displacement of each vertex, of any scale, at `time` seconds of the slowed motion. */
  private displaced(time: number): Float32Array {
    const { shapes, vertices } = this.model!;
    const moved = new Float32Array(vertices.length);
    for (const { mode, amplitude, frequencyHz, decayPerS } of this.weights) {
      const realTime = time / this.slowness;
      const factor = amplitude * Math.sin(2 * Math.PI * frequencyHz * realTime) * Math.exp(-decayPerS * realTime);
      if (Math.abs(factor) < 1e-12 * Math.abs(amplitude)) continue;
      const shape = shapes.get(mode);
      if (!shape) continue;
      const share = factor * shape.scale;
      for (let i = 0; i < moved.length; i += 1) moved[i]! += share * shape.components[i]!;
    }
    return moved;
  }

  private paint(moved?: Float32Array, withColors = true): void {
    const { position, color } = this.body!.geometry.attributes as Record<string, THREE.BufferAttribute>;
    const places = position!.array as Float32Array, colors = color!.array as Float32Array;
    const { vertices } = this.model!;
    const factor = moved ? BEND * this.extent / this.largest : 0;
    for (let i = 0; i < places.length; i += 1) places[i] = vertices[i]! + (moved ? factor * moved[i]! : 0);
    position!.needsUpdate = true;
    if (this.marked && this.dot.visible) this.carryDot(this.marked, places);
    if (!withColors) return;
    const shade = new THREE.Color();
    for (let i = 0; i < places.length; i += 3) {
      const share = moved ? Math.min(1, Math.hypot(moved[i]!, moved[i + 1]!, moved[i + 2]!) / this.largest) : 0;
      const place = share * (RAMP.length - 1), stop = Math.min(RAMP.length - 2, Math.floor(place));
      (moved ? shade.lerpColors(RAMP[stop]!, RAMP[stop + 1]!, place - stop) : REST_COLOR).toArray(colors, i);
    }
    color!.needsUpdate = true;
  }

  /** Moves the dot with the vertex nearest to it. */
  private carryDot({ point, vertex }: Strike, places: Float32Array): void {
    const moved = new THREE.Vector3().fromArray(places, 3 * vertex).sub(this.place(vertex));
    this.dot.position.set(...point).add(moved);
  }

  private lookAt(geometry: THREE.BufferGeometry): void {
    geometry.computeBoundingSphere();
    const { center, radius } = geometry.boundingSphere!;
    this.extent = 2 * radius;
    this.controls.target.copy(center);
    this.camera.near = radius / 100;
    this.camera.far = radius * 100;
    this.camera.position.copy(center).add(new THREE.Vector3(1.6, 1.2, 2.2).multiplyScalar(radius * 1.1));
    this.dot.visible = false;
    this.fit();
  }

  private fit(): void {
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.dirty = true;
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
  }

  private draw(now: number): void {
    if (this.paused || !this.body || document.hidden || !this.canvas.clientWidth || !this.budget.mayDraw(performance.now())) return;
    if (!this.weights.length && !this.controls.update() && !this.dirty) return;
    this.dirty = false;
    if (this.model && this.weights.length) {
      const time = this.still ? 0.25 : (now - this.begin) / 1000;
      this.paint(this.displaced(this.slowness === 1 ? time : time % SLOW_STRIKE_S), this.weights.length > 1);
    }
    if (this.weights.length) this.controls.update();
    this.budget.draw(this.scene, this.camera);
  }
}
