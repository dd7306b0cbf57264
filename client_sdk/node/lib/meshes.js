// SPDX-License-Identifier: Apache-2.0
'use strict';

const fs = require('fs/promises');
const path = require('path');
const { CarillonError } = require('./errors');

function rows(values) {
  if (values.length && typeof values[0] !== 'number') return Array.from(values);
  return Array.from({ length: values.length / 3 }, (_, i) => [values[3 * i], values[3 * i + 1], values[3 * i + 2]]);
}

/**
 * The fewest digits that give the number back, written as each client writes them, so that equal arrays make equal files.
 */
function digits(value) {
  const size = Math.abs(value);
  return size === 0 || (size >= 1e-4 && size < 1e16) ? String(value) : value.toExponential();
}

/** Makes an OBJ file of vertices (metres) and triangles, whose indices count from zero. */
function makeObj({ vertices, triangles }) {
  const points = rows(vertices);
  const corners = rows(triangles);
  if (corners.some((corner) => Array.from(corner).some((i) => !(i >= 0 && i < points.length)))) {
    throw new CarillonError('MESH_INDEX_OUT_OF_RANGE', `a triangle names a vertex outside 0 to ${points.length - 1}; ` +
      'indices count from zero');
  }
  const lines = [...points.map((point) => `v ${Array.from(point, digits).join(' ')}\n`),
    ...corners.map((corner) => `f ${Array.from(corner, (i) => i + 1).join(' ')}\n`)];
  return Buffer.from(lines.join(''));
}

/** Reads a mesh file, or makes one of { vertices, triangles }. Returns its bytes, its format and a label. */
async function toMeshFile(mesh) {
  if (typeof mesh !== 'string') return { data: makeObj(mesh), format: 'obj', label: '' };
  const { ext, name } = path.parse(mesh);
  return { data: await fs.readFile(mesh), format: ext.slice(1).toLowerCase(), label: name };
}

module.exports = { toMeshFile };
