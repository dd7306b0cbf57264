// SPDX-License-Identifier: Apache-2.0
import * as THREE from 'three';
import type { Surface } from './modal_model';

const WIDTH = 128, HEIGHT = 96;
let renderer: THREE.WebGLRenderer | undefined;

/** A small picture of a body, as a data address. */
export function drawThumbnail({ vertices, triangles }: Surface): string {
  renderer ??= new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true, alpha: true });
  renderer.setSize(WIDTH, HEIGHT, false);
  const geometry = new THREE.BufferGeometry();
  geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
  geometry.setAttribute('position', new THREE.BufferAttribute(vertices, 3));
  geometry.computeBoundingSphere();
  const { center, radius } = geometry.boundingSphere!;
  const scene = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera(40, WIDTH / HEIGHT, radius / 100, radius * 100);
  camera.position.copy(center).add(new THREE.Vector3(1.3, 1, 1.8).multiplyScalar(1.25 * radius));
  camera.lookAt(center);
  camera.add(new THREE.DirectionalLight(0xffffff, 1.6));
  scene.add(new THREE.HemisphereLight(0xffffff, 0x777788, 2), camera,
    new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ color: 0x3f6fa8, flatShading: true })));
  renderer.render(scene, camera);
  geometry.dispose();
  return renderer.domElement.toDataURL();
}
