// SPDX-License-Identifier: Apache-2.0
// The surface of a mesh file as a picture, before the daemon has read it.
import { BufferAttribute, BufferGeometry, Mesh } from 'three';
import { OBJLoader } from 'three/addons/loaders/OBJLoader.js';
import { PLYLoader } from 'three/addons/loaders/PLYLoader.js';
import { STLLoader } from 'three/addons/loaders/STLLoader.js';

/** The triangles of an OBJ, STL or PLY file, in metres; undefined for other formats, and for files that cannot be read. */
export async function previewOf(file: File, metresPerUnit: number): Promise<BufferGeometry | undefined> {
  const bytes = await file.arrayBuffer();
  const found = trianglesIn(bytes, file.name.split('.').pop()!.toLowerCase());
  found?.scale(metresPerUnit, metresPerUnit, metresPerUnit);
  found?.computeVertexNormals();
  return found;
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

/** The places that a refusal names, "(1, 2, 3) m". */
export function placesIn(message: string): [number, number, number][] {
  return [...message.matchAll(/\(([-+.\de]+), ([-+.\de]+), ([-+.\de]+)\) m/g)].map(([, x, y, z]) => [Number(x), Number(y), Number(z)]);
}
