// SPDX-License-Identifier: Apache-2.0
// The surface of a mesh file as a picture, before the daemon has read it.
import { BufferAttribute, BufferGeometry, Mesh, Vector3 } from 'three';
import { OBJLoader } from 'three/addons/loaders/OBJLoader.js';
import { PLYLoader } from 'three/addons/loaders/PLYLoader.js';
import { STLLoader } from 'three/addons/loaders/STLLoader.js';

/** The surface of a file, and the sides of the box around it, in the file's unit. */
export interface Preview { surface: BufferGeometry; sides: [number, number, number] }

/** The triangles of an OBJ, STL or PLY file; undefined for other formats, and for files that cannot be read. */
export async function previewOf(file: File): Promise<Preview | undefined> {
  const bytes = await file.arrayBuffer();
  const found = trianglesIn(bytes, file.name.split('.').pop()!.toLowerCase());
  if (!found) return undefined;
  found.computeVertexNormals();
  found.computeBoundingBox();
  return { surface: found, sides: found.boundingBox!.getSize(new Vector3()).toArray() };
}

function trianglesIn(bytes: ArrayBuffer, format: string): BufferGeometry | undefined {
  try {
    if (format === 'stl') return new STLLoader().parse(bytes);
    if (format === 'ply') return new PLYLoader().parse(bytes);
    if (format === 'obj') return joined(new OBJLoader().parse(new TextDecoder().decode(bytes)).children as Mesh[]);
  } catch {
    // The daemon says what is wrong with the file.
  }
  return undefined;
}

function joined(parts: Mesh[]): BufferGeometry {
  const places = parts.map((part) => part.geometry.getAttribute('position').array as Float32Array);
  const all = new Float32Array(places.reduce((sum, one) => sum + one.length, 0));
  let end = 0;
  for (const one of places) { all.set(one, end); end += one.length; }
  return new BufferGeometry().setAttribute('position', new BufferAttribute(all, 3));
}

const PLACE = /\(([-+.\de]+), ([-+.\de]+), ([-+.\de]+)\) m/g;

/** The places that a refusal names, "(1, 2, 3) m". */
export function placesIn(message: string): [number, number, number][] {
  return [...message.matchAll(PLACE)].map(([, x, y, z]) => [Number(x), Number(y), Number(z)]);
}

/** A refusal with the coordinates of the file, so that the place is found there. */
export function inUnitOf(metres: number, unit: string, message: string): string {
  return message.replace(PLACE, (...parts) => `(${parts.slice(1, 4).map((part) => Number((Number(part) / metres).toPrecision(6))).join(', ')}) ${unit}`);
}
