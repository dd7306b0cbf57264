// SPDX-License-Identifier: Apache-2.0
'use strict';

const { counted, refuse, refuseNoMessage, refuseNoNumbers, refuseUnknown, tuple, whole } = require('./checks');
const { CarillonError } = require('./errors');

// The types of contacts, from which pack.py makes contacts.d.ts.
/**
 * @typedef {import('./index').ObjectLike} ObjectLike
 * @typedef {import('./index').Striker} Striker
 * @typedef {import('./index').Table} Table
 * @typedef {import('./index').Vector} Vector
 * @typedef {import('./index').Rotation} Rotation
 * @typedef {import('../types/carillon/v1/Roughness').Roughness} Roughness
 * @typedef {number | ArrayLike<number>} Numbers
 * @typedef {ObjectLike | ArrayLike<ObjectLike>} Objects
 */

/**
 * One strike: metres and newton seconds, in the object's own frame; without a duration, in seconds, the striker
 * determines it.
 * @typedef {{ point: Vector, impulse: Vector, duration?: number, striker?: Striker }} Strike
 */

/**
 * The other body of a contact, if it is an object, too; the point is in that object's own frame. In a stream with frame
 * 'scene' it is in the scene's, and by default that of the contact.
 * @typedef {{ object: ObjectLike, point?: Vector, rotation?: Rotation }} Second
 */

/**
 * A blow that you intend, such as that of a hammer, `timeOffset` seconds after the step's time. With `normal`, which is
 * perpendicular to the surfaces that touch, of any length and in the frame of the impulse, friction does not shorten it.
 * @typedef {Strike & { object: ObjectLike, timeOffset?: number, second?: Second, normal?: Vector }} Impact
 */

/**
 * One contact as an engine reports it: the impulse over the whole step, also at rest. `partner` is a whole number from 0
 * to 4294967295 that names the other body.
 * @typedef {Impact & { partner?: number, roughness?: Roughness }} Contact
 */

/**
 * A contact force, newtons, of a simulator that separates resting contacts from impacts itself.
 * @typedef {{ object: ObjectLike, point: Vector, force: Vector, roughness?: Roughness, second?: Second }} ContactForce
 */

/**
 * What all contacts have as columns. One object, or one number, stands for all rows. `secondPoints` are in the frame of
 * each second object; in a stream with frame 'scene' they are in the scene's, and by default the points.
 * @typedef {{ objects: Objects, points: Table, secondObjects?: Objects, secondPoints?: Table, secondRotations?: Table }}
 *   ContactPlaces
 */

/**
 * The roughness of contacts that slide or roll, as columns.
 * @typedef {{ travelSpeeds?: Numbers, roughnessDepth?: number, irregularityLength?: number }} ContactRoughness
 */

/**
 * Impacts as columns. A duration is in seconds, zero or more; NaN leaves one to the daemon. A normal of zeros is none.
 * @typedef {ContactPlaces & { impulses: Table, durations?: Numbers, timeOffsets?: Numbers, striker?: Striker,
 *   normals?: Table }} Impacts
 */

/**
 * An engine's contacts as columns. Partners are whole numbers from 0 to 4294967295 that name the other bodies.
 * @typedef {Impacts & ContactRoughness & { partners?: Numbers }} Contacts
 */

/**
 * Contact forces as columns, newtons.
 * @typedef {ContactPlaces & ContactRoughness & { forces: Table }} ContactForces
 */

// The largest magnitude of the time of a step, as contact.proto says.
const LARGEST_TIME_S = 1e10;

// What the arguments mean, for messages.
const STREAM_FRAME = "in the stream's frame, which is each object's own unless it was opened with frame: 'scene'";
const ROTATION = 'a quaternion [w, x, y, z] of length 1';
const MEANINGS = {
  points: `metres ${STREAM_FRAME}`,
  impulses: `newton seconds ${STREAM_FRAME}`,
  forces: `newtons ${STREAM_FRAME}`,
  secondPoints: "metres in the second object's own frame, or in the scene's in a stream with frame: 'scene'",
  secondRotations: `${ROTATION} from the first object's frame into the second's`,
  normals: 'perpendicular to the surfaces that touch, of any length, in the frame of the impulses',
  positions: "metres in the scene's frame",
  orientations: `${ROTATION} from the object's frame into the scene's`,
};
const POSE = "[x, y, z] in metres, or { position, orientation } with a quaternion [w, x, y, z], in the scene's frame";
// Handles and partners have 32 bits in the contract.
const OBJECT = 'an object that scene.add or trace.add returned, or its handle, a whole number from 0 to 4294967295';
const PARTNER = 'a whole number from 0 to 4294967295 that names the other body, such as its place in your list of ' +
  'bodies';
const DURATION = 'zero seconds or more, or NaN, which leaves it to the daemon';
const STEP_KEYS = ['contacts', 'impacts', 'forces', 'poses', 'listener', 'timeScale'];
const COLLISION = ['duration', 'timeOffset', 'striker', 'normal'];
const COLLISIONS = ['durations', 'timeOffsets', 'striker', 'normals'];
/** The Frame in which points and impulses are those of the scene. */
const SCENE = 'FRAME_SCENE';
const SECOND_COLUMNS = ['secondObjects', 'secondPoints', 'secondRotations'];
const ROUGH_COLUMNS = ['travelSpeeds', 'roughnessDepth', 'irregularityLength'];
// The kinds of contacts in a step: of each the kind in the contract, the vector of a row and of columns, the field of
// that vector, and what else rows and columns may have.
const KINDS = {
  contacts: { kind: 'CONTACT_KIND_REPORTED', vector: 'impulse', vectors: 'impulses', field: 'impulseNewtonSeconds',
    row: [...COLLISION, 'partner', 'roughness'], columns: [...COLLISIONS, 'partners', ...ROUGH_COLUMNS] },
  impacts: { kind: 'CONTACT_KIND_IMPACT', vector: 'impulse', vectors: 'impulses', field: 'impulseNewtonSeconds',
    row: COLLISION, columns: COLLISIONS },
  forces: { kind: 'CONTACT_KIND_FORCE', vector: 'force', vectors: 'forces', field: 'forceNewtons',
    row: ['roughness'], columns: ROUGH_COLUMNS },
};

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

function vector(values, name, meaning) {
  tuple(values, 3, name, `[x, y, z]: ${meaning}`);
  return present({ x: values[0], y: values[1], z: values[2] });
}

function quaternion(values, name) {
  tuple(values, 4, name, ROTATION);
  return present({ w: values[0], x: values[1], y: values[2], z: values[3] });
}

/** A pose is a position [x, y, z], or { position, orientation } with the quaternion [w, x, y, z]. */
function toPose(pose, name = 'pose') {
  if (pose === undefined || pose === null) return undefined;
  if (typeof pose !== 'object') refuse(pose, name, POSE);
  if ('length' in pose) return { positionM: vector(pose, name, "metres in the scene's frame") };
  refuseUnknown(pose, ['position', 'orientation'], name);
  const { position, orientation } = pose;
  return { positionM: vector(position, `the position of ${name}`, "metres in the scene's frame"),
    ...given('orientation', orientation && quaternion(orientation, `the orientation of ${name}`)) };
}

function toStriker(striker) {
  if (typeof striker === 'string') return { striker };
  if (striker !== undefined && striker !== null) refuseNoMessage(striker, 'HertzContact', 'striker');
  return striker;
}

function handleOf(object, name = 'object') {
  const handle = typeof object === 'number' ? object : object?.handle;
  if (typeof handle !== 'number') refuse(object, name, OBJECT);
  return whole(handle, name, OBJECT);
}

/** The number that names the other body of a contact; undefined if there is none. */
function partnerOf(partner, name) {
  return partner === undefined || partner === null ? undefined : whole(partner, name, PARTNER);
}

/** A duration in seconds; undefined where the daemon determines it. */
function durationOf(duration, name) {
  if (duration === undefined || duration === null || Number.isNaN(duration)) return undefined;
  if (typeof duration !== 'number' || duration < 0) refuse(duration, name, DURATION);
  return duration;
}

/** The handle that a new object is to have; undefined if the caller leaves it open. */
function toHandle(handle) {
  return handle === undefined || handle === null ? undefined
    : whole(handle, 'handle of add', 'a whole number from 0 to 4294967295');
}

/** Handles as a column; one object stands for all rows. */
function handles(objects, count, name = 'objects') {
  const list = objects && typeof objects === 'object' && 'length' in objects
    ? Array.from(objects, (object) => handleOf(object, `an entry of ${name}`))
    : new Array(count).fill(handleOf(objects, name));
  if (list.length !== count) throw new RangeError(`${name} has the length ${list.length}; it must have ${count}`);
  return list;
}

/** Numbers of a table with `width` columns, given as one flat array or as one array a row. */
function table(values, name, width = 3) {
  if (!values || typeof values !== 'object' || !('length' in values)) {
    refuse(values, name, `numbers, ${width} a contact: ${MEANINGS[name]}`);
  }
  const flat = values.length && typeof values[0] !== 'number' ? Array.from(values).flatMap((row) => Array.from(row))
    : Array.from(values);
  if (flat.length % width) {
    throw new RangeError(`${name} has ${counted(flat.length, 'number')}; it must have ${width} a contact: ${MEANINGS[name]}`);
  }
  for (const value of flat) if (typeof value !== 'number') refuse(value, `an entry of ${name}`, MEANINGS[name]);
  return flat;
}

function number(value, name) {
  if (typeof value !== 'number') refuse(value, name, 'a number');
  return value;
}

/** One number a row, or one for all, each as `read` returns it. */
function numbers(values, count, name, read = number) {
  const isList = values !== null && typeof values === 'object' && 'length' in values;
  const list = (isList ? Array.from(values) : new Array(count).fill(values))
    .map((value) => read(value, `an entry of ${name}`));
  if (list.length !== count) throw new RangeError(`${name} has the length ${list.length}; it must have ${count}`);
  return list;
}

/** The message of contacts given as columns, in a Frame; `name` is their key in the step. */
function contactColumns(columns, name, frame) {
  const { kind, vectors, field, columns: keys } = KINDS[name];
  refuseUnknown(columns, ['objects', 'points', vectors, ...SECOND_COLUMNS, ...keys], name);
  const pointM = table(columns.points, 'points');
  const values = table(columns[vectors], vectors);
  if (pointM.length !== values.length) {
    throw new RangeError(`points has the numbers of ${counted(pointM.length / 3, 'contact')} and ${vectors} has those of ` +
      `${values.length / 3}; each contact needs both`);
  }
  const count = pointM.length / 3;
  const { roughnessDepth, irregularityLength } = columns;
  refuseNoNumbers({ roughnessDepth, irregularityLength }, name);
  return { kind, object: handles(columns.objects, count), pointM, [field]: values, ...numberColumns(columns, count),
    ...present({ roughnessDepth, irregularityLengthM: irregularityLength }),
    ...given('normal', columns.normals && table(columns.normals, 'normals')),
    ...secondColumns(columns, pointM, frame), ...given('hertz', toStriker(columns.striker)) };
}

/** The columns of one number a contact, as far as they are given. */
function numberColumns({ durations, timeOffsets, partners, travelSpeeds }, count) {
  const made = {};
  // A duration below zero is absent.
  if (durations !== undefined) {
    made.durationS = numbers(durations, count, 'durations', (value, name) => durationOf(value, name) ?? -1);
  }
  if (timeOffsets !== undefined) made.timeOffsetS = numbers(timeOffsets, count, 'timeOffsets');
  if (partners !== undefined) {
    made.partner = numbers(partners, count, 'partners', (value, name) => whole(value, name, PARTNER));
  }
  if (travelSpeeds !== undefined) made.travelSpeedMPerS = numbers(travelSpeeds, count, 'travelSpeeds');
  return made;
}

/** In the scene's frame one place has the same coordinates for both objects. */
function secondColumns({ secondObjects, secondPoints, secondRotations }, pointM, frame) {
  if (secondObjects === undefined) return {};
  return { secondObject: handles(secondObjects, pointM.length / 3, 'secondObjects'),
    secondPointM: secondPoints === undefined && frame === SCENE ? pointM : table(secondPoints, 'secondPoints'),
    ...given('secondRotation', secondRotations && table(secondRotations, 'secondRotations', 4)) };
}

function secondObject({ second, point }, where, frame) {
  if (!second) return second;
  refuseUnknown(second, ['object', 'point', 'rotation'], `second of ${where}`);
  const own = second.point === undefined && frame === SCENE ? point : second.point;
  return { object: handleOf(second.object, `object of second of ${where}`),
    pointM: vector(own, `point of second of ${where}`, MEANINGS.secondPoints),
    ...given('rotation', second.rotation && quaternion(second.rotation, `rotation of second of ${where}`)) };
}

function toRoughness(roughness, where) {
  if (roughness) refuseNoMessage(roughness, 'Roughness', `roughness of ${where}`);
  return roughness;
}

/** The message of one contact; `name` is the key of the list in the step that has it. */
function contactRow(row, name, where, frame) {
  const { kind, vector: key, vectors, field, row: keys } = KINDS[name];
  refuseUnknown(row, ['object', 'point', key, 'second', ...keys], where);
  refuseNoNumbers({ timeOffset: row.timeOffset }, where);
  return { kind, ...present({ object: handleOf(row.object, `object of ${where}`), timeOffsetS: row.timeOffset,
    partner: partnerOf(row.partner, `partner of ${where}`) }),
  pointM: vector(row.point, `point of ${where}`, MEANINGS.points),
  [field]: vector(row[key], `${key} of ${where}`, MEANINGS[vectors]),
  ...given('durationS', durationOf(row.duration, `duration of ${where}`)),
  ...given('normal', row.normal && vector(row.normal, `normal of ${where}`, MEANINGS.normals)),
  ...given('roughness', toRoughness(row.roughness, where)), ...given('hertz', toStriker(row.striker)),
  ...given('second', secondObject(row, where, frame)) };
}

function poseColumns(columns) {
  refuseUnknown(columns, ['objects', 'positions', 'orientations'], 'poses');
  const positionM = table(columns.positions, 'positions');
  const made = { object: handles(columns.objects, positionM.length / 3), positionM };
  if (columns.orientations) made.orientation = table(columns.orientations, 'orientations', 4);
  return made;
}

/** The scale of a step's time. Throws TypeError if it is not one. */
function checkedScale(scale) {
  if (scale !== undefined && scale !== 0 && !(scale >= 0.001 && scale <= 1000)) {
    refuse(scale, 'timeScale', 'simulation time over time of the sound, 0.001 to 1000, or 0 in a pause');
  }
  return scale;
}

/**
 * Makes the message of the step at a simulation time, seconds, of a stream or trace with this Frame. Contacts, impacts
 * and forces are rows if they are an array, and columns otherwise.
 */
function makeStep(time, own, frame) {
  const content = own ?? {};
  if (typeof time !== 'number') refuse(time, 'time', 'the simulation time in seconds');
  refuseUnknown(content, STEP_KEYS, 'step');
  const step = { ...present({ timeS: time }), ...given('timeScale', checkedScale(content.timeScale)) };
  for (const name of Object.keys(KINDS)) {
    const contacts = content[name];
    if (Array.isArray(contacts)) {
      const rows = contacts.map((row, i) => contactRow(row, name, `${name}[${i}]`, frame));
      step.contacts = [...step.contacts ?? [], ...rows];
    } else if (contacts) {
      step.contactColumns = [...step.contactColumns ?? [], contactColumns(contacts, name, frame)];
    }
  }
  if (content.listener) step.listener = toPose(content.listener, 'listener');
  if (content.poses) step.poses = poseColumns(content.poses);
  return step;
}

/**
 * Throws CarillonError (INVALID_STREAM) if step `number` of a run, counted from zero, cannot have the time after that
 * of the step before, both in seconds. `repair` says what another run needs.
 */
function refuseTime(time, number, before, repair) {
  if (!(Math.abs(time) <= LARGEST_TIME_S)) {
    throw new CarillonError('INVALID_STREAM', `the time of step ${number} is ${time}; give the simulation time in ` +
      `seconds, at most ${LARGEST_TIME_S} before or after 0`);
  }
  if (number && time < before) {
    throw new CarillonError('INVALID_STREAM', `time goes back from ${before} s to ${time} s at step ${number}; ` +
      repair);
  }
}

/** The number of contacts and poses of a step. */
function countRows({ contacts, contactColumns, poses }) {
  const lists = [contacts, poses?.object, ...(contactColumns ?? []).map((columns) => columns.object)];
  return lists.reduce((count, list) => count + (list?.length ?? 0), 0);
}

/**
 * The rows of one strike. Throws a TypeError if it has not one point and one impulse, or if the impulse is zero.
 * @param {ObjectLike} object
 * @param {*} [strike]
 */
function strikeOf(object, { point, impulse, duration, striker } = {}) {
  tuple(point, 3, 'point', "[x, y, z]: metres in the object's own frame");
  const meaning = "[x, y, z]: newton seconds in the object's own frame";
  if (tuple(impulse, 3, 'impulse', meaning).every((component) => component === 0)) {
    refuse(impulse, 'impulse', `other than zero, because the strike would be silent: ${meaning}`);
  }
  return [{ object, point, impulse, duration: durationOf(duration, 'duration'), striker }];
}

/** Returns the objects of rows, or of columns, as the caller gave them. */
function objectsOf(content) {
  const rows = Array.isArray(content) ? content : [content];
  return rows.flatMap((row) => [row?.objects, row?.secondObjects, row?.object, row?.second?.object].flat());
}

module.exports = { checkedScale, contactColumns, countRows, given, makeStep, numbers, objectsOf, poseColumns, present,
  refuseTime, strikeOf, toHandle, toPose };
