// SPDX-License-Identifier: Apache-2.0
'use strict';

const fs = require('fs/promises');
const util = require('util');
const { choice, counted, refuse, refuseNoMessage, refuseNoNumbers, refuseUnknown } = require('./checks');
const { given, makeStep, objectsOf, present, refuseTime, toHandle, toPose } = require('./contacts');
const { message } = require('./contract');
const { CarillonError } = require('./errors');
const { named, toRadiation } = require('./materials');

const FORMAT_VERSION = 1;

/** "scene" becomes FRAME_SCENE, "gaussian" PULSE_SHAPE_GAUSSIAN. */
function streamSettings({ frame, pulseShape }) {
  return present({ frame: choice(frame, ['object', 'scene'], 'FRAME_', 'frame'),
    pulseShape: choice(pulseShape, ['raised_cosine', 'gaussian'], 'PULSE_SHAPE_', 'pulseShape') });
}

/**
 * A recorded simulation: `header`, `objects` and `steps` are the messages of contact_trace.proto. `step`, the length of
 * the simulator's steps in seconds, is needed for all but impacts: by it the daemon knows whether a step was left out,
 * and so when a blow is over. A rendering then dates each blow as a stream does, which adds its scheduling delay.
 * `labels` are text of your own by name, which `carillon render` copies into the record of the sound.
 */
class Trace {
  constructor(own = {}) {
    refuseUnknown(own, ['step', 'simulator', 'hearing', 'listener', 'frame', 'pulseShape', 'labels'], 'Trace');
    const { step, simulator, hearing, listener, labels, ...settings } = own;
    refuseNoNumbers({ step }, 'Trace');
    if (hearing) refuseNoMessage(hearing, 'Hearing', 'hearing');
    for (const [name, text] of Object.entries(labels ?? {})) {
      if (typeof text !== 'string') refuse(text, `the label ${name} of Trace`, 'text');
    }
    this.header = { formatVersion: FORMAT_VERSION, ...present({ simulator, stepS: step, labels }),
      ...given('hearing', hearing), ...given('listener', toPose(listener, 'listener')), ...streamSettings(settings) };
    this.objects = [];
    this.steps = [];
  }

  /** Adds an object, which is there from the beginning. Returns its handle. */
  add(model, settings = {}) {
    refuseUnknown(settings, ['material', 'size', 'gain', 'pose', 'label', 'handle', 'radiation'], 'add');
    const { material, size = 1, gain = 1, pose, label, handle, radiation } = settings;
    refuseNoNumbers({ size, gain }, 'add');
    const own = toHandle(handle) || 1 + this.objects.reduce((most, object) => Math.max(most, object.handle), 0);
    this.objects.push({ handle: own, ...named(model, material), size, gain, ...present({ label }),
      ...given('pose', toPose(pose)), ...present({ radiation: toRadiation(radiation) }) });
    return own;
  }

  /**
   * Adds a step, as ContactStream.step sends one. Throws CarillonError (INVALID_STREAM) and adds nothing if the time
   * goes back, or is over 1e10 s before or after 0. A trace without a clock can be rendered if its times are 0 to
   * 86400 s.
   */
  step(time, content) {
    if (!this.header.stepS && (content?.contacts || content?.forces || content?.poses)) {
      throw new TypeError("contacts, forces and poses need the length of the simulator's steps in seconds, as in a " +
        'stream: new Trace({ step: 1 / 240 })');
    }
    for (const rows of [content?.contacts, content?.impacts, content?.forces, content?.poses]) {
      const other = objectsOf(rows).find((object) => object?.scene);
      if (other) {
        throw new TypeError(`a row has an object of ${other.scene.name}, which is not in the trace; give what trace.add ` +
          'returned');
      }
    }
    const made = makeStep(time, content, this.header.frame);
    refuseTime(time, this.steps.length, this.steps.at(-1)?.timeS ?? 0, 'make another trace for another run');
    this.steps.push(made);
  }

  /** The header, the objects, then the steps, each a ContactTraceRecord. */
  * records() {
    yield { header: this.header };
    for (const object of this.objects) yield { object };
    for (const step of this.steps) yield { step };
  }

  [util.inspect.custom]() {
    return `<Trace: ${counted(this.objects.length, 'object')}, ${counted(this.steps.length, 'step')}, to ` +
      `${this.steps.at(-1)?.timeS ?? 0} s>`;
  }

  /** The bytes of a .contacts file. */
  bytes() {
    const pieces = [];
    for (const record of this.records()) {
      const data = message('ContactTraceRecord').serialize(record);
      pieces.push(varint(data.length), data);
    }
    return Buffer.concat(pieces);
  }

  /** Writes a .contacts file. */
  async write(path) {
    await fs.writeFile(path, this.bytes());
  }

  /** Reads a .contacts file. Throws CarillonError (TRACE_MALFORMED, TRACE_TOO_NEW). */
  static async read(path) {
    const trace = new Trace();
    const bytes = await fs.readFile(path);
    let number = 0;
    for (const record of readRecords(bytes, path)) {
      if ((number === 0) !== (record.record === 'header')) {
        throw new CarillonError('TRACE_MALFORMED', `${path}: record ${number} must${number ? ' not' : ''} be a header`);
      }
      if (record.record === 'header') trace.header = checked(record.header, path);
      else if (record.record === 'object') trace.objects.push(record.object);
      else if (record.record === 'step') trace.steps.push(record.step);
      else {
        throw new CarillonError('TRACE_MALFORMED', `${path}: record ${number} is of no known kind; update this ` +
          'program, or write the trace again');
      }
      number += 1;
    }
    if (number === 0) throw new CarillonError('TRACE_MALFORMED', `${path} is empty; write the trace again`);
    return trace;
  }
}

/** The header, if this program can read what follows it. */
function checked(header, path) {
  if (!header.formatVersion) {
    throw new CarillonError('TRACE_MALFORMED', `${path} does not begin with the header of a contact trace; write the ` +
      'trace again');
  }
  if (header.formatVersion > FORMAT_VERSION) {
    throw new CarillonError('TRACE_TOO_NEW', `${path} has format version ${header.formatVersion}, this program ` +
      `reads ${FORMAT_VERSION}; update it`);
  }
  return header;
}

function varint(number) {
  const bytes = [];
  let rest = number;
  for (; rest > 0x7f; rest = Math.floor(rest / 128)) bytes.push((rest & 0x7f) | 0x80);
  return Buffer.from([...bytes, rest]);
}

function* readRecords(bytes, path) {
  for (let at = 0, number = 0; at < bytes.length; number += 1) {
    let size = 0;
    let factor = 1;
    do {
      size += (bytes[at] & 0x7f) * factor;
      factor *= 128;
      at += 1;
    } while (bytes[at - 1] > 0x7f);
    let record;
    try {
      record = at + size <= bytes.length && message('ContactTraceRecord').deserialize(bytes.subarray(at, at + size));
    } catch (error) {
      record = undefined; // It is no message of this type.
    }
    if (!record) {
      throw new CarillonError('TRACE_MALFORMED', `${path}: record ${number} is cut off or damaged; write the trace ` +
        'again');
    }
    at += size;
    yield record;
  }
}

module.exports = { Trace, streamSettings };
