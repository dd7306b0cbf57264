// SPDX-License-Identifier: Apache-2.0
'use strict';

const fs = require('fs/promises');
const path = require('path');
const { refuse } = require('./checks');
const { CarillonError } = require('./errors');

function isList(values) {
  return values !== null && typeof values === 'object' && 'length' in values;
}

function rows(values, name) {
  if (typeof values[0] === 'number' && values.length % 3) {
    throw new TypeError(`${name} has ${values.length} numbers; it must have three a row, or be a list of rows`);
  }
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
  const points = rows(vertices, 'vertices');
  const corners = rows(triangles, 'triangles');
  if (corners.some((corner) => Array.from(corner).some((i) => !(i >= 0 && i < points.length)))) {
    throw new CarillonError('MESH_INDEX_OUT_OF_RANGE', `a triangle names a vertex outside 0 to ${points.length - 1}; ` +
      'indices count from zero');
  }
  const lines = [...points.map((point) => `v ${Array.from(point, digits).join(' ')}\n`),
    ...corners.map((corner) => `f ${Array.from(corner, (i) => i + 1).join(' ')}\n`)];
  return Buffer.from(lines.join(''));
}

/**
 * Returns a file with data of another. A file elsewhere is refused, because an untrusted document could have any file of
 * the user sent to the daemon.
 */
function beside(file, name) {
  if (path.isAbsolute(name) || name.split(/[\\/]/).includes('..') || name.includes('://')) {
    throw new CarillonError('MESH_UNREADABLE', `${file} keeps data in "${name}", which is not in its folder: put it there`);
  }
  return path.join(path.dirname(file), name);
}

function unescapeUri(uri) {
  try {
    return decodeURIComponent(uri);
  } catch {
    return uri; // An address with a stray % is the name of a file as it is.
  }
}

/**
 * Returns a glTF document with the data of its buffers in it. A text that is no such document stays as it is, so that the
 * daemon says what is wrong with it.
 */
async function withBuffers(file, data) {
  let document;
  try {
    document = JSON.parse(data.toString().replace(/^\uFEFF/, ''));
  } catch {
    return data;
  }
  // An array in glTF 2.0, an object in glTF 1.0.
  const external = Object.values((document && document.buffers) || {})
    .filter((buffer) => buffer && typeof buffer.uri === 'string' && !/^data:/i.test(buffer.uri));
  for (const buffer of external) {
    const content = await fs.readFile(beside(file, unescapeUri(buffer.uri)));
    buffer.uri = `data:application/octet-stream;base64,${content.toString('base64')}`;
  }
  return external.length ? Buffer.from(JSON.stringify(document)) : data;
}

const INPUT = new RegExp('^[ \\t]*\\*(?:(INCLUDE)|(?:NODE|ELEMENT|NSET|ELSET))[ \\t]*(?:,[^,\\n]*)*?' +
  '(,[ \\t]*INPUT[ \\t]*=[ \\t]*"?([^",\\r\\n]+?)"?[ \\t]*(?=[,\\r\\n]|(?![^])))[^\\n]*\\n?', 'gim');

/**
 * Returns the lines of an .inp file, or of the file `name` that it includes, with those of the files that they include. A
 * comment "**@ LINE FILE" says from where the next line is.
 */
async function withIncludes(file, data, name = '', depth = 0) {
  const text = data.toString('latin1');
  let joined = '';
  let end = 0;
  for (const found of text.matchAll(INPUT)) {
    const other = found[3].replaceAll('\\', '/');
    if (depth === 16) throw new CarillonError('MESH_UNREADABLE', `${file}: ${name} includes ${other} without an end`);
    const content = await withIncludes(file, await fs.readFile(beside(file, other)), other, depth + 1);
    const after = found.index + found[0].length;
    const line = text.slice(0, after).split('\n').length;
    joined += text.slice(end, found.index) + (found[1] ? '' : `${found[0].replace(found[2], '').trimEnd()}\n`) +
      `**@ 1 ${other}\n${content.toString('latin1').trimEnd()}\n**@ ${line} ${name}\n`;
    end = after;
  }
  return end ? Buffer.from(joined + text.slice(end), 'latin1') : data;
}

/** Reads a mesh file, or makes one of { vertices, triangles }. Returns its bytes, its format and a label. */
async function toMeshFile(mesh) {
  const isArrays = mesh !== null && typeof mesh === 'object' && isList(mesh.vertices) && isList(mesh.triangles);
  if (typeof mesh !== 'string' && !isArrays) refuse(mesh, 'the mesh', 'the path of a file, or { vertices, triangles }');
  if (typeof mesh !== 'string') return { data: makeObj(mesh), format: 'obj', label: '' };
  const { ext, name } = path.parse(mesh);
  const format = ext.slice(1).toLowerCase();
  const data = await fs.readFile(mesh);
  const whole = { gltf: withBuffers, inp: withIncludes }[format];
  return { data: whole ? await whole(mesh, data) : data, format, label: name };
}

module.exports = { toMeshFile };
