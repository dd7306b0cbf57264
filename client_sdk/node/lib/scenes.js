// SPDX-License-Identifier: Apache-2.0
'use strict';

const util = require('util');
const { counted, refuseNoNumbers, refuseNoObject, refuseUnknown } = require('./checks');
const { countRows, given, makeStep, objectsOf, present, refuseTime, strikeOf, toHandle,
  toPose } = require('./contacts');
const { CarillonError, fromCall, fromInfo } = require('./errors');
const { named, toMaterial, toRadiation } = require('./materials');
const { streamSettings } = require('./traces');
const { warnOfContacts, warnOfOpenStream } = require('./warnings');

// Steps that may wait for the network before the oldest is dropped.
const MOST_WAITING = 4096;
/** Steps that wait are sent together up to these numbers, because a message costs far more than a small step. */
const MOST_STEPS_TOGETHER = 256;
const MOST_ROWS_TOGETHER = 1024;
const OBJECT_KEYS = ['material', 'size', 'gain', 'pose', 'radiation'];

/** An object of a scene. It may be given wherever handles are wanted. */
class SoundingObject {
  constructor(scene, message) {
    this.scene = scene;
    this.message = message;
  }

  get name() {
    return this.message.name;
  }

  get handle() {
    return this.message.handle;
  }

  /** Strikes the object now. Throws CarillonError if the strike is refused, and warns of a point far from the object. */
  async strike(strike) {
    refuseUnknown(strike, ['point', 'impulse', 'duration', 'striker'], 'strike');
    const impacts = strikeOf(this, strike);
    const stream = this.scene.stream({ step: 0.001, delay: 0 });
    stream.step(0, { impacts });
    await stream.close(false);
    if (stream.rejection) throw stream.rejection;
    warnOfContacts(stream.warnings);
  }

  /**
   * Changes what is given; a pose is reached after `glide` seconds. `gain` is a linear factor: 1 keeps the level, 0.5
   * lowers it by 6 dB, and 10 ** (x / 20) changes it by x decibels.
   */
  async update(changes) {
    refuseUnknown(changes, [...OBJECT_KEYS, 'glide'], 'update');
    const { material, size, gain, pose, glide = 0, radiation } = changes;
    refuseNoNumbers({ size, gain, glide }, 'update');
    const request = { name: this.name, glideS: glide, ...given('material', material && toMaterial(material)),
      ...given('size', size), ...given('gain', gain), ...given('pose', toPose(pose)),
      ...present({ radiation: toRadiation(radiation) }) };
    this.message = (await this.scene.client.call('SceneService', 'UpdateObject', request)).object;
  }

  [util.inspect.custom]() {
    const { handle, soundingModeCount: count, lowestFrequencyHz: low, highestFrequencyHz: high } = this.message;
    return `<SoundingObject ${handle}: ${counted(count, 'mode')}, ${low.toFixed(1)} to ${high.toFixed(1)} Hz>`;
  }

  /** Fades the object out and removes it. */
  async remove() {
    await this.scene.client.call('SceneService', 'RemoveObject', { name: this.name });
  }
}

/**
 * A scene of the daemon. Without `keep` it ends a minute after the last connection that used it is closed. `existing`:
 * it was there before its createScene with an id.
 */
class Scene {
  constructor(client, name, existing = false) {
    this.client = client;
    this.name = name;
    this.existing = existing;
  }

  /** Returns the scene's state: its volume, peak, and how long it lasts. */
  async get() {
    return (await this.client.call('SceneService', 'GetScene', { name: this.name })).scene;
  }

  /**
   * Adds all objects, each { model, material, size, ... }, or none if one is refused; `metadata.index` of the error is
   * its place.
   */
  async addAll(objects) {
    return this.addObjects(objects.map((object, i) => this.newObject(object, `object ${i} of addAll`)));
  }

  async addObjects(wanted) {
    const answer = await this.client.call('SceneService', 'AddObjects', { scene: this.name, objects: wanted });
    const models = answer.objects.filter(({ radiation }, i) => !wanted[i].radiation &&
      radiation === 'RADIATION_MODEL_PAPER_COUPLING').map(({ modalModel }) => modalModel);
    await this.warnOfTransfers(models);
    return answer.objects.map((object) => new SoundingObject(this, object));
  }

  /** Warns, once of each model, if the transfers that the objects lack are being computed. */
  async warnOfTransfers(models) {
    const { soundedModels } = this.client;
    const unasked = models.filter((model) => !soundedModels.has(model));
    for (const model of unasked) soundedModels.add(model);
    if (unasked.length) {
      await this.client.warnOfTransfers(unasked, "the objects sound by the paper's coupling, at other levels, until they " +
        'change to it');
    }
  }

  /** The part of a request that describes an object. */
  newObject(object, where) {
    refuseUnknown(object, ['model', ...OBJECT_KEYS, 'handle'], where);
    const { model, material, size, gain, pose, handle, radiation } = object;
    refuseNoNumbers({ size, gain }, where);
    return { ...named(model, material), ...present({ size, handle: toHandle(handle) }),
      ...given('gain', gain), ...given('pose', toPose(pose)), ...present({ radiation: toRadiation(radiation) }) };
  }

  /**
   * Adds an object, ready to be struck. Without a material it gets the one that the model was asked for with. Its gain
   * is linear, as in SoundingObject.update. A TransferWarning tells, once a model, that it is still being computed how
   * the model radiates.
   */
  async add(model, settings = {}) {
    refuseNoObject(settings, OBJECT_KEYS, 'add');
    return (await this.addObjects([this.newObject({ ...settings, model }, 'add')]))[0];
  }

  /** Returns the objects of the scene by their handles. */
  async objects() {
    const answer = await this.client.call('SceneService', 'ListObjects', { scene: this.name });
    return answer.objects.map((object) => new SoundingObject(this, object));
  }

  /**
   * Changes the volume, and returns the scene's state. `gain` is a linear factor: 1 keeps the level, and 10 ** (x / 20)
   * changes it by x decibels. A `muted` scene rings on unheard. If you set `solo` for some of your scenes, the others
   * are not heard.
   */
  async update(volume) {
    refuseUnknown(volume, ['gain', 'muted', 'solo'], 'update');
    const { gain, muted, solo } = volume;
    refuseNoNumbers({ gain }, 'update');
    const request = { name: this.name, ...given('gain', gain), ...given('muted', muted), ...given('solo', solo) };
    return (await this.client.call('SceneService', 'UpdateScene', request)).scene;
  }

  /** Fades out all that sounds in the scene. Later contacts sound. */
  async stop() {
    await this.client.call('SceneService', 'StopAll', { scene: this.name });
  }

  /** Begins to record the scene alone, before the gain and the limiter of the output. */
  listen(request = {}) {
    return this.client.listen({ ...request, scene: this.name });
  }

  /** Moves the listener, within `glide` seconds. */
  async moveListener(pose, glide = 0) {
    refuseNoNumbers({ glide }, 'moveListener');
    await this.client.call('SceneService', 'UpdateListener', { scene: this.name, pose: toPose(pose), glideS: glide });
  }

  /** Opens a stream for the contacts of a simulation whose steps last `step` seconds. */
  stream(own = {}) {
    refuseUnknown(own, ['step', 'delay', 'frame', 'pulseShape'], 'stream');
    const { step, delay, ...settings } = own;
    refuseNoNumbers({ step, delay }, 'stream');
    return new ContactStream(this, { scene: this.name, stepS: step, ...given('schedulingDelayS', delay),
      ...streamSettings(settings) });
  }

  [util.inspect.custom]() {
    return `<Scene ${this.name} of ${this.client.server}>`;
  }

  /** Deletes the scene and fades out its objects. */
  async delete() {
    await this.client.call('SceneService', 'DeleteScene', { name: this.name });
  }
}

/** Throws a TypeError for an object of another scene, where its handle may mean another object. */
function refuseOtherScenes(content, scene) {
  const other = objectsOf(content).find((object) => object instanceof SoundingObject && object.scene.name !== scene);
  if (other) {
    throw new TypeError(`a row has an object of ${other.scene.name}, and this is a stream of ${scene}; give objects of ` +
      'that scene');
  }
}

/**
 * Sends the contacts of each step. `report` is the daemon's newest answer, with the counts so far. It counts an impulse
 * as accepted before it sounds: one that is due after the scene is deleted is never heard, for which `report.aheadS`
 * says how long to wait after the end. `droppedStepCount` steps were not sent: the oldest ones, when 4096 waited. When it
 * is closed, a warning of the process, a ContactWarning, tells of each fact in `warnings`.
 */
class ContactStream {
  constructor(scene, start) {
    this.report = undefined;
    this.droppedStepCount = 0;
    this.error = undefined;
    this.start = start;
    const { client } = scene;
    this.client = client;
    this.call = client.stub('ContactService').StreamContacts();
    client.openCalls.add(this.call);
    this.ended = new Promise((resolve) => {
      this.call.on('data', (answer) => { this.report = answer; });
      this.call.on('error', (error) => {
        this.error = fromCall(error, client.server);
        if (client.isClosed && !this.isClosing) {
          warnOfOpenStream(start.scene);
          warnOfContacts(this.warnings);
        }
      });
      this.call.on('close', () => {
        client.openCalls.delete(this.call);
        resolve();
      });
    });
    this.stepCount = 0; // steps that `step` has taken, also those that were dropped
    this.time = 0; // of the newest of them
    this.waiting = [];
    this.handedCount = 0; // steps that gRPC has not sent yet
    this.isFull = !this.call.write({ start });
    this.call.on('drain', () => {
      this.isFull = false;
      this.write();
    });
  }

  /** Hands steps to the network while it takes them. */
  write() {
    while (this.waiting.length && !this.isFull) {
      const steps = this.takeSteps();
      this.handedCount += steps.length;
      this.isFull = !this.call.write({ steps }, () => {
        this.handedCount -= steps.length;
      });
    }
    if (this.isClosing && !this.waiting.length) this.call.end();
  }

  /** Takes the oldest steps that wait, as many as one message has. */
  takeSteps() {
    let count = 1;
    let rowCount = countRows(this.waiting[0]);
    while (count < Math.min(this.waiting.length, MOST_STEPS_TOGETHER)) {
      rowCount += countRows(this.waiting[count]);
      if (rowCount > MOST_ROWS_TOGETHER) break;
      count += 1;
    }
    return this.waiting.splice(0, count);
  }

  /** What the daemon found out about the contacts so far, such as blowCount. */
  get findings() {
    return this.report?.findings ?? undefined;
  }

  /** What was probably not meant about the contacts so far, each with id, count, figures and text. */
  get warnings() {
    const told = [...(this.report?.warnings ?? [])];
    const count = this.droppedStepCount;
    if (count) {
      told.push({ id: 'STEPS_DROPPED', count, figures: {}, text: `${counted(count, 'step')} not sent, because over ` +
        `${MOST_WAITING} waited for the network; await stream.step(...), because a loop that never awaits anything sends ` +
        'nothing before it ends' });
    }
    return told;
  }

  /** Why the newest rejected contact was rejected; undefined if none was so far. */
  get rejection() {
    return this.report?.rejectedCount ? fromInfo(this.report.lastRejection) : undefined;
  }

  /** How many contacts came too late for their time so far, and sounded at once. */
  get lateCount() {
    return this.report?.lateCount ?? 0;
  }

  /** How many times simulation time was mapped anew so far, because every step was late. */
  get remapCount() {
    return this.report?.remapCount ?? 0;
  }

  [util.inspect.custom]() {
    const { stepCount: steps = 0, acceptedCount: accepted = 0, rejectedCount: rejected = 0 } = this.report ?? {};
    return `<ContactStream of ${this.start.scene}: ${counted(steps, 'step')}, ${counted(accepted, 'contact')} in time, ` +
      `${this.lateCount} late, ${rejected} rejected>`;
  }

  /** How many steps wait for the network. */
  get waitingStepCount() {
    return this.waiting.length + this.handedCount;
  }

  /**
   * Sends a step at a simulation time, seconds. Throws CarillonError if the stream has failed or has been closed
   * (CONTACT_STREAM_ENDED), and if the time goes back, or is over 1e10 s before or after 0 (INVALID_STREAM); such a
   * step is not sent, and the stream can go on. The promise gives the network a turn: a loop that never awaits anything
   * sends nothing before it ends, and of more than 4096 steps that wait the oldest are dropped and counted in
   * `droppedStepCount`.
   */
  step(time, content) {
    if (this.isClosing) {
      throw new CarillonError('CONTACT_STREAM_ENDED', 'this stream has been closed, so that the step would not ' +
        'sound; open another one by scene.stream');
    }
    if (this.error) throw this.error;
    for (const rows of [content?.contacts, content?.impacts, content?.forces, content?.poses]) {
      refuseOtherScenes(rows, this.start.scene);
    }
    const made = makeStep(time, content, this.start.frame);
    refuseTime(time, this.stepCount, this.time, 'open another stream for another run');
    this.stepCount += 1;
    this.time = time;
    if (this.waiting.length >= MOST_WAITING) {
      this.waiting.shift();
      this.droppedStepCount += 1;
    }
    this.waiting.push(made);
    this.write();
    return new Promise(setImmediate);
  }

  /** Waits until the daemon has taken all steps, and warns unless `warn` is false. Returns the last report. */
  async close(warn = true) {
    this.isClosing = true;
    this.client.openCalls.delete(this.call); // It ends by itself, also after the client's close().
    this.write();
    await this.ended;
    if (this.error) throw this.error;
    if (warn) warnOfContacts(this.warnings);
    return this.report;
  }
}

module.exports = { ContactStream, Scene, SoundingObject };
