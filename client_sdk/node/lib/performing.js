// SPDX-License-Identifier: Apache-2.0
'use strict';

const util = require('util');
const { counted, refuse, refuseNoMessage, refuseNoNumbers, refuseUnknown } = require('./checks');
const { checkedScale, contactColumns, given, numbers, poseColumns, present, toHandle, toPose } = require('./contacts');
const { message } = require('./contract');
const { CarillonError, fromCall, fromInfo } = require('./errors');
const { named, toRadiation } = require('./materials');
const { samplesOf } = require('./sound');
const { streamSettings } = require('./traces');
const { warnOfContacts } = require('./warnings');

// The trailing metadata in which the daemon tells of warnings.
const SUMMARY_KEY = 'carillon-summary-bin';
const ENVIRONMENT = 'the index of an environment, a whole number from 0';
const KINDS = ['omni', 'stereo', 'ears', 'ambisonic'];

function toMicrophone(microphone) {
  refuseUnknown(microphone, ['kind', 'order', 'pose', 'on'], 'a microphone');
  const { kind = 'omni', order, pose, on } = microphone;
  if (!KINDS.includes(kind)) refuse(kind, 'kind of a microphone', KINDS.map((name) => `'${name}'`).join(', '));
  return { kind: `MICROPHONE_KIND_${kind.toUpperCase()}`, ...present({ ambisonicOrder: order, object: toHandle(on) }),
    ...given('pose', toPose(pose)) };
}

/**
 * Environments whose sound comes in step with their simulation. Client.perform begins them. `channelCount` is that of
 * all microphones together, and `latency` is the constant time from a contact to its sound, in seconds.
 */
class Performance {
  constructor(client, own) {
    refuseUnknown(own, ['step', 'environments', 'microphones', 'latency', 'frame', 'pulseShape', 'sampleRateHz',
      'fullScalePa', 'hearing', 'tellImpacts'], 'perform');
    const { step, environments = 1, microphones = [], latency, sampleRateHz, fullScalePa, hearing, tellImpacts } = own;
    refuseNoNumbers({ step, environments, latency, sampleRateHz, fullScalePa }, 'perform');
    if (hearing) refuseNoMessage(hearing, 'Hearing', 'hearing');
    this.settings = { ...present({ stepS: step, environmentCount: environments, latencyS: latency,
      sampleRateHz, fullScalePa, tellImpacts }),
    microphones: microphones.map(toMicrophone), ...given('hearing', hearing),
    ...streamSettings({ frame: own.frame, pulseShape: own.pulseShape }) };
    this.client = client;
    this.environmentCount = environments;
    this.next = {}; // what the next step brings beside its contacts
    this.handle = 0;
    this.rejectedCount = 0;
    this.paperCount = 0;
    this.warnings = [];
    this.isClosed = false;
  }

  async begin() {
    this.call = this.client.stub('AudioService').Perform();
    this.client.openCalls.add(this.call);
    this.ended = new Promise((resolve) => this.call.once('status', resolve));
    this.answers = this.call[Symbol.asyncIterator]();
    const { begun } = await this.ask({ settings: this.settings });
    this.sampleRateHz = begun.sampleRateHz;
    this.channelCount = begun.channelCount;
    this.latency = begun.latencyFrames / begun.sampleRateHz;
    return this;
  }

  /** Returns an index of an environment. Throws TypeError or CarillonError if it is none. */
  environmentOf(index, name) {
    if (!Number.isInteger(index)) refuse(index, name, ENVIRONMENT);
    if (index >= 0 && index < this.environmentCount) return index;
    throw new CarillonError('PERFORMANCE_MALFORMED',
      `environment ${index} is unknown; the performance has ${this.environmentCount}, counted from 0`);
  }

  /** The indices of environments for a message, where none means all. */
  indices(environments) {
    if (environments === undefined || environments === null) return [];
    const list = typeof environments === 'number' ? [environments] : Array.from(environments);
    if (!list.length) throw new RangeError('environments is empty; leave it out to mean all of them');
    return list.map((index) => this.environmentOf(index, 'an entry of environments'));
  }

  /** Columns with the environment of each row, or one for all; `read` makes the other columns. */
  withEnvironments({ environments, ...rest }, read) {
    const columns = read(rest);
    if (environments === undefined || environments === null) return { columns };
    return { columns, environment: numbers(environments, columns.object.length, 'environments',
      (index, name) => this.environmentOf(index, name)) };
  }

  /** Sends a request, and returns the first message of its answer. */
  ask(request) {
    this.send(request);
    return this.receive();
  }

  send(request) {
    if (this.isClosed) {
      throw new CarillonError('CONTACT_STREAM_ENDED',
        'this performance has been closed; begin another one by Client.perform');
    }
    this.call.write(request);
  }

  async receive() {
    try {
      const { value, done } = await this.answers.next();
      if (done) throw new Error('the performance has ended');
      return value;
    } catch (error) {
      throw fromCall(error, this.client.server);
    }
  }

  /**
   * Adds an object to the `environments`, by default to all, before the contacts of the next step. Returns its handle,
   * which is the same in each of them.
   */
  add(model, settings = {}) {
    refuseUnknown(settings, ['environments', 'material', 'size', 'gain', 'pose', 'handle', 'radiation'], 'add');
    const { environments, material, size = 1, gain = 1, pose, handle, radiation } = settings;
    refuseNoNumbers({ size, gain }, 'add');
    this.handle = toHandle(handle) || this.handle + 1;
    this.next.addedObjects = [...this.next.addedObjects ?? [], {
      object: { handle: this.handle, ...named(model, material), size, gain, ...given('pose', toPose(pose)),
        ...present({ radiation: toRadiation(radiation) }) },
      environments: this.indices(environments) }];
    return this.handle;
  }

  /**
   * Removes an object from the environments, by default from all, at the next step. Its sound fades out within 10 ms.
   */
  remove(object, environments) {
    this.next.removedObjects = [...this.next.removedObjects ?? [],
      { object: toHandle(object), environments: this.indices(environments) }];
  }

  /**
   * Ends the sound of environments, by default of all, at once, and lets them begin anew: their time is zero, and their
   * objects and microphones are where they were added.
   */
  reset(environments) {
    this.send({ reset: { environments: this.indices(environments) } });
  }

  /**
   * Performs a step of all environments, with contacts, impacts, forces and poses as columns at its end; their
   * `environments` have the index of each row, or one for all, by default 0. The sound lasts the step over `timeScale`,
   * by default 1, and the step in a pause, at 0. Returns the samples of the step, a Float32Array with element
   * [environment][channel][frame], `frameCount`, and the impacts if the performance tells them, as the columns of
   * PerformedImpacts. Throws CarillonError if a contact is rejected, or an object to be added or removed; the step
   * was performed without it, and the error has what it gave as `performed`.
   */
  async step(content = {}) {
    refuseUnknown(content, ['contacts', 'impacts', 'forces', 'poses', 'timeScale'], 'step');
    const step = { ...this.next, ...given('timeScale', checkedScale(content.timeScale)) };
    for (const name of ['contacts', 'impacts', 'forces']) {
      if (!content[name]) continue;
      step.contacts = [...step.contacts ?? [],
        this.withEnvironments(content[name], (columns) => contactColumns(columns, name, this.settings.frame))];
    }
    if (content.poses) step.poses = this.withEnvironments(content.poses, poseColumns);
    this.next = {};
    let { samples: answer } = await this.ask({ step });
    const pieces = [answer.samples];
    while (!answer.isLast) {
      ({ samples: answer } = await this.receive());
      pieces.push(answer.samples);
    }
    if (answer.paperCouplingObjectCount > this.paperCount) {
      await this.client.warnOfTransfers((step.addedObjects ?? []).map(({ object }) => object.modalModel),
        "the objects sound by the paper's coupling, also after a reset");
    }
    this.paperCount = answer.paperCouplingObjectCount;
    const performed = { samples: samplesOf(pieces), frameCount: answer.frameCount, impacts: answer.impacts };
    if (answer.rejectedCount > this.rejectedCount) {
      this.rejectedCount = answer.rejectedCount;
      throw Object.assign(fromInfo(answer.lastRejection), { performed });
    }
    return performed;
  }

  /**
   * Ends the performance, and warns of what is probably wrong with its contacts. Returns the warnings, which
   * `warnings` keeps.
   */
  async close() {
    this.isClosed = true;
    this.client.openCalls.delete(this.call);
    this.call.on('error', () => {}); // which a step has thrown
    this.call.end();
    const { metadata } = await this.ended;
    this.warnings = metadata.get(SUMMARY_KEY)
      .flatMap((bytes) => message('RenderSummary').deserialize(bytes).warnings);
    warnOfContacts(this.warnings);
    return this.warnings;
  }

  [util.inspect.custom]() {
    return `<Performance of ${counted(this.environmentCount, 'environment')}>`;
  }
}

module.exports = { Performance };
