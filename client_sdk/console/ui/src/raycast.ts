// SPDX-License-Identifier: Apache-2.0

type Triple = [number, number, number];

/**
 * The triangle (its number) that a ray meets first from outside, and the point; after Möller and Trumbore (1997). 200,000
 * triangles take some milliseconds: a tree over them would take longer to build than many clicks save.
 */
export function firstHit(vertices: Float32Array, triangles: Uint32Array, [ox, oy, oz]: Triple, [dx, dy, dz]: Triple):
    { triangle: number; point: Triple } | undefined {
  let triangle = -1, least = Infinity;
  for (let i = 0; i < triangles.length; i += 3) {
    const a = 3 * triangles[i]!, b = 3 * triangles[i + 1]!, c = 3 * triangles[i + 2]!;
    const ax = vertices[a]!, ay = vertices[a + 1]!, az = vertices[a + 2]!;
    const ux = vertices[b]! - ax, uy = vertices[b + 1]! - ay, uz = vertices[b + 2]! - az;
    const vx = vertices[c]! - ax, vy = vertices[c + 1]! - ay, vz = vertices[c + 2]! - az;
    const px = dy * vz - dz * vy, py = dz * vx - dx * vz, pz = dx * vy - dy * vx;
    const determinant = ux * px + uy * py + uz * pz;
    if (determinant <= 0) continue;
    const sx = ox - ax, sy = oy - ay, sz = oz - az;
    const u = sx * px + sy * py + sz * pz;
    if (u < 0 || u > determinant) continue;
    const qx = sy * uz - sz * uy, qy = sz * ux - sx * uz, qz = sx * uy - sy * ux;
    const v = dx * qx + dy * qy + dz * qz;
    if (v < 0 || u + v > determinant) continue;
    const distance = (vx * qx + vy * qy + vz * qz) / determinant;
    if (distance < 0 || distance >= least) continue;
    least = distance;
    triangle = i / 3;
  }
  return triangle < 0 ? undefined : { triangle, point: [ox + least * dx, oy + least * dy, oz + least * dz] };
}
