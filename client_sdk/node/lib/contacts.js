// SPDX-License-Identifier: Apache-2.0
'use strict';

/** Copies the fields that differ from their default: others are not written, as in every other language. */
function present(fields) {
  const made = {};
  for (const [name, value] of Object.entries(fields)) {
    const isDefault = Object.is(value, 0) || value === '' || value === undefined || value === null;
    if (!isDefault) made[name] = value;
  }
  return made;
}

/** Adds a field that may be absent, and is written if it is given, also as zero. */
function given(name, value) {
  return value === undefined || value === null ? {} : { [name]: value };
}

function vector(values) {
  return present({ x: values[0], y: values[1], z: values[2] });
}

function quaternion(values) {
  return present({ w: values[0], x: values[1], y: values[2], z: values[3] });
}

/** A pose is a position [x, y, z], or { position, orientation } with the quaternion [w, x, y, z]. */
function toPose(pose) {
  if (pose === undefined || pose === null) return undefined;
  if (!('position' in pose)) return { position_m: vector(pose) };
  const { position, orientation } = pose;
  return { position_m: vector(position), ...given('orientation', orientation && quaternion(orientation)) };
}

function toStriker(striker) {
  return typeof striker === 'string' ? { striker } : striker;
}

function handleOf(object) {
  return typeof object === 'number' ? object : object.handle;
}

/** Handles as a column; one object stands for all rows. */
function handles(objects, count, name = 'objects') {
  const list = typeof objects === 'object' && 'length' in objects ? Array.from(objects, handleOf)
    : new Array(count).fill(handleOf(objects));
  if (list.length !== count) throw new RangeError(`${name} has ${list.length} entries; it must have ${count}`);
  return list;
}

/** Numbers of a table with `width` columns, given as one flat array or as one array a row. */
function table(values, name, width = 3) {
  const flat = values.length && typeof values[0] !== 'number' ? Array.from(values).flatMap((row) => Array.from(row))
    : Array.from(values);
  if (flat.length % width) throw new RangeError(`${name} has ${flat.length} numbers; it must have ${width} a contact`);
  return flat;
}

/** One number a row, or one for all. */
function numbers(values, count, name) {
  const list = typeof values === 'number' ? new Array(count).fill(values) : Array.from(values);
  if (list.length !== count) throw new RangeError(`${name} has ${list.length} entries; it must have ${count}`);
  return list;
}

function impulseColumns(columns) {
  const point_m = table(columns.points, 'points');
  const impulse_newton_seconds = table(columns.impulses, 'impulses');
  if (point_m.length !== impulse_newton_seconds.length) {
    throw new RangeError(`there are ${point_m.length / 3} points and ${impulse_newton_seconds.length / 3} impulses; ` +
      'each contact needs one of both');
  }
  const count = point_m.length / 3;
  const made = { object: handles(columns.objects, count), point_m, impulse_newton_seconds };
  // A duration below zero is absent.
  if (columns.durations !== undefined) {
    made.duration_s = numbers(columns.durations, count, 'durations').map((value) => (Number.isNaN(value) ? -1 : value));
  }
  if (columns.timeOffsets !== undefined) made.time_offset_s = numbers(columns.timeOffsets, count, 'timeOffsets');
  if (columns.secondObjects !== undefined) {
    made.second_object = handles(columns.secondObjects, count, 'secondObjects');
    made.second_point_m = table(columns.secondPoints, 'secondPoints');
    if (columns.secondRotations) made.second_rotation = table(columns.secondRotations, 'secondRotations', 4);
  }
  return { ...made, ...given('hertz', toStriker(columns.striker)) };
}

function contactColumns(columns) {
  const impulses = impulseColumns(columns);
  const count = impulses.object.length;
  const made = { impulses };
  if (columns.partners !== undefined) made.partner = numbers(columns.partners, count, 'partners');
  if (columns.travelSpeeds !== undefined) {
    made.travel_speed_m_per_s = numbers(columns.travelSpeeds, count, 'travelSpeeds');
  }
  return { ...made,
    ...present({ depth: columns.roughnessDepth, irregularity_length_m: columns.irregularityLength }) };
}

function secondObject(second) {
  return second && { object: handleOf(second.object), point_m: vector(second.point),
    ...given('rotation', second.rotation && quaternion(second.rotation)) };
}

/** What rows of impulses and of contacts have in common. */
function impulseRow(row) {
  return { ...present({ object: handleOf(row.object), time_offset_s: row.timeOffset }), point_m: vector(row.point),
    impulse_newton_seconds: vector(row.impulse), ...given('duration_s', row.duration),
    ...given('hertz', toStriker(row.striker)), ...given('second', secondObject(row.second)) };
}

function contactRow(row) {
  return { ...impulseRow(row), ...present({ partner: row.partner }), ...given('roughness', row.roughness) };
}

function forceRow(row) {
  return { ...present({ object: handleOf(row.object) }), point_m: vector(row.point), force_newtons: vector(row.force),
    ...given('roughness', row.roughness), ...given('second', secondObject(row.second)) };
}

function poseColumns(columns) {
  const position_m = table(columns.positions, 'positions');
  const made = { object: handles(columns.objects, position_m.length / 3), position_m };
  if (columns.orientations) made.orientation = table(columns.orientations, 'orientations', 4);
  return made;
}

/**
 * Makes the message of the step at a simulation time, seconds. Contacts and impulses are rows if they are an array, and
 * columns otherwise.
 */
function makeStep(time, { contacts, impulses, forces, poses, listener } = {}) {
  const step = present({ time_s: time });
  if (Array.isArray(impulses)) step.impulses = impulses.map(impulseRow);
  else if (impulses) step.columns = impulseColumns(impulses);
  if (forces) step.sustained = forces.map(forceRow);
  if (Array.isArray(contacts)) step.contacts = contacts.map(contactRow);
  else if (contacts) step.contact_columns = contactColumns(contacts);
  if (listener) step.listener = toPose(listener);
  if (poses) step.pose_columns = poseColumns(poses);
  return step;
}

module.exports = { given, makeStep, present, toPose };
