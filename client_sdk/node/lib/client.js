// SPDX-License-Identifier: Apache-2.0
'use strict';

const util = require('util');
const { defaultServer } = require('./address');
const { choice, nearest, refuse, refuseNoMessage, refuseNoNumbers, refuseNoObject,
  refuseUnknown } = require('./checks');
const { given, toPose } = require('./contacts');
const { services } = require('./contract');
const { channelCredentials, channelOptions } = require('./credentials');
const { CarillonError, fromCall, fromInfo } = require('./errors');
const { toMaterial } = require('./materials');
const { toMeshFile } = require('./meshes');
const { Model, isTransfer } = require('./models');
const { Performance } = require('./performing');
const { Places, mostRenderings } = require('./places');
const { stateOf } = require('./progress');
const { Scene } = require('./scenes');
const { toSettings } = require('./settings');
const { Sound, samplesOf, samplesOfIntegers } = require('./sound');
const { Trace } = require('./traces');
const { warnOfContacts, warnOfLabel, warnOfOneChannel, warnOfTransfers } = require('./warnings');

const JOB_STATES = ['queued', 'running', 'succeeded', 'failed', 'cancelled'];

/** The fields of ListJobsRequest and WatchJobsRequest for states such as 'failed'. */
function jobFilter(filters) {
  refuseUnknown(filters, ['states', 'labelContains'], 'jobs');
  const { states = [], labelContains = '' } = filters;
  return { states: states.map((state) => choice(state, JOB_STATES, 'JOB_STATE_', 'an entry of states')), labelContains };
}

/** The methods of this package for those of the contract that have streams. */
const STREAMS = { Listen: 'listen, and for await (const block of recording)', Render: 'render',
  StreamContacts: 'Scene.stream', UploadMesh: 'upload', WatchJob: 'watch', WatchJobs: 'watchJobs' };
const MODELS = 'modalModels/';
const PIECE_BYTES = 1 << 20;

/**
 * Connects to a daemon: "unix:PATH" or "HOST:PORT", by default where defaultServer() says. `tlsRoots` is the PEM file
 * with the certificates that vouch for a daemon with TLS. Over TCP the daemon may want to know the caller, by `token`
 * (default: $CARILLON_TOKEN), or by the PEM files `tlsCertificate` and `tlsKey`.
 */
function connect(server, options = {}) {
  refuseUnknown(options, ['tlsRoots', 'token', 'tlsCertificate', 'tlsKey'], 'connect');
  const address = server ?? defaultServer();
  if (typeof address !== 'string' || /^(\/|https?:\/\/)/i.test(address)) refuse(address, 'server', '"unix:PATH" or "HOST:PORT"');
  return new Client(address, options);
}

/** The request for a model: an object, or the name of its material alone and then an object with the rest. */
function requestFor(given, more) {
  const [request, rest] = typeof given === 'string' ? [{ material: given }, more] : [given, undefined];
  for (const object of [request, rest]) refuseNoObject(object, ['material'], 'createModel');
  if (more !== rest || rest?.material !== undefined) {
    throw new TypeError('createModel is given two materials or requests; give createModel(mesh, { material: ' +
      "'oak', ... }) or createModel(mesh, 'oak', { ... })");
  }
  return { ...rest, ...request };
}

/** A connection. Its process can end when it is closed. */
class Client {
  constructor(server, options = {}) {
    this.server = server;
    this.credentials = channelCredentials(options);
    this.options = channelOptions(server, options);
    this.stubs = new Map();
    this.openCalls = new Set();
    this.soundedModels = new Set(); // for which it was asked whether their transfer is being computed
  }

  /** The client of a service of the contract that grpc-js makes, for calls that have no method here. */
  stub(service) {
    if (this.isClosed) throw new Error('this client has been closed; connect again');
    if (!this.stubs.has(service)) {
      this.stubs.set(service, new services[service](this.server, this.credentials, this.options));
    }
    return this.stubs.get(service);
  }

  /** Calls a method that takes one message and answers one. Throws a TypeError for a method that has streams. */
  call(service, method, request) {
    const path = services[service]?.service[method];
    if (!path) refuse(`${service}.${method}`, 'the call', 'a method of the contract, such as "SceneService", "ListScenes"');
    if (path.requestStream || path.responseStream) {
      throw new TypeError(`${service}.${method} has a stream of messages, which call cannot carry; use ` +
        (STREAMS[method] ?? `stub('${service}').${method}`));
    }
    return new Promise((resolve, reject) => {
      this.stub(service)[method](request, (error, answer) => {
        if (error) reject(fromCall(error, this.server));
        else resolve(answer);
      });
    });
  }

  /** Yields the answers of a stream. Its errors are those of this package. */
  async* answers(stream) {
    this.openCalls.add(stream);
    try {
      yield* stream;
    } catch (error) {
      throw fromCall(error, this.server);
    } finally {
      this.openCalls.delete(stream);
      stream.cancel();
    }
  }

  /** Returns the version, the age, the limits and the features of the daemon. */
  info() {
    return this.call('ServerService', 'GetServerInfo', {});
  }

  /** Returns the state of the daemon's mixer and output. */
  status() {
    return this.call('AudioService', 'GetMixer', {});
  }

  /** Stores a mesh, a file or { vertices, triangles }. Returns its digest. */
  async upload(mesh) {
    return this.uploadFile(await toMeshFile(mesh));
  }

  uploadFile(file) {
    return new Promise((resolve, reject) => {
      const stream = this.stub('ModalModelService').UploadMesh((error, answer) => {
        if (error) reject(fromCall(error, this.server));
        else resolve(answer.meshDigest);
      });
      for (let at = 0; at < file.data.length; at += PIECE_BYTES) {
        stream.write({ data: file.data.subarray(at, at + PIECE_BYTES) });
      }
      stream.end();
    });
  }

  /**
   * Returns the model of a mesh, which is computed if the daemon does not have it. `unit` is that of its coordinates:
   * 'm', 'cm', 'mm', 'in', or a number of metres. `accuracy` is the largest estimated error of a frequency, such as 0.01
   * for 1 %. The request may have other fields of CreateModalModelRequest, such as size, settings, maxFrequencyHz or
   * priority. The name of a material may come before it: createModel(mesh, 'oak', { unit: 'mm' }).
   */
  async createModel(mesh, wanted, more) {
    const { material, label, onProgress = () => {}, unit, accuracy, ...request } = requestFor(wanted, more);
    if (label !== undefined && label !== null && typeof label !== 'string') refuse(label, 'label of createModel', 'text');
    const own = { ...request, material: toMaterial(material) };
    refuseNoMessage(own, 'CreateModalModelRequest', 'createModel', ['label', 'onProgress', 'unit', 'accuracy']);
    Object.assign(own, given('settings', toSettings(request.settings, unit, accuracy)));
    const file = await toMeshFile(mesh);
    const { job } = await this.call('ModalModelService', 'CreateModalModel', { ...own,
      meshDigest: await this.uploadFile(file), meshFormat: file.format, label: label ?? file.label });
    const model = await this.model((await this.watch(job, onProgress)).modalModel, material);
    warnOfLabel(model.label, label);
    return model;
  }

  /**
   * Follows a job to its end and returns its last state. Throws CarillonError if it fails, or if it has not ended after
   * `timeout` seconds (DEADLINE_EXCEEDED).
   */
  async watch(job, onProgress = () => {}, timeout = undefined) {
    let newest = job;
    const deadline = timeout === undefined ? {} : { deadline: Date.now() + 1000 * timeout };
    try {
      for await (const answer of this.answers(this.stub('DecompositionService').WatchJob({ name: job.name }, deadline))) {
        newest = answer.job;
        onProgress(newest);
      }
    } catch (error) {
      if (error.reason !== 'DEADLINE_EXCEEDED') throw error;
      throw new CarillonError(error.reason, `${newest.label || newest.name} is ${stateOf(newest)} and has not ended ` +
        `after ${Number(timeout.toPrecision(3))} s; wait longer, or cancel the job`);
    }
    if (newest.state === 'JOB_STATE_CANCELLED') {
      throw new CarillonError('JOB_CANCELLED', `${newest.name} was cancelled; create the model again`);
    }
    if (newest.state !== 'JOB_STATE_SUCCEEDED') throw fromInfo(newest.error);
    return newest;
  }

  /** Yields the jobs that match, newest first; filters are `states`, such as 'failed', and `labelContains`. */
  async* jobs(filters = {}) {
    for (let pageToken = ''; ;) {
      const page = await this.call('DecompositionService', 'ListJobs', { ...jobFilter(filters), pageToken });
      yield* page.jobs;
      pageToken = page.nextPageToken;
      if (!pageToken) return;
    }
  }

  /**
   * Yields the jobs that wait or run, then null, and then each job that matches after every change, until the loop is
   * left. Filters as for jobs.
   */
  async* watchJobs(filters = {}) {
    const stream = this.stub('DecompositionService').WatchJobs(jobFilter(filters));
    for await (const answer of this.answers(stream)) yield answer.job ?? null;
  }

  /** Returns the model that the text means: a name, a label, or the first digits of a digest. */
  async model(text, material) {
    if (typeof text !== 'string' || !text.replace(MODELS, '')) {
      refuse(text, 'the model', 'its label, its name, or the first digits of its digest');
    }
    const name = text.startsWith(MODELS) ? text : await this.find(text);
    const answer = await this.call('ModalModelService', 'GetModalModel', { name });
    return new Model(this, answer.modalModel, material ?? answer.modalModel.material ?? undefined);
  }

  /** Yields the models that match, newest first; filters are fields of ListModalModelsRequest. */
  async* models(filters = {}) {
    refuseNoMessage(filters, 'ListModalModelsRequest', 'models');
    for (let pageToken = ''; ;) {
      const page = await this.call('ModalModelService', 'ListModalModels', { ...filters, pageToken });
      for (const summary of page.modalModels) yield new Model(this, summary, summary.material ?? undefined);
      pageToken = page.nextPageToken;
      if (!pageToken) return;
    }
  }

  /** Returns the name of the one model with this label, or whose digest begins with these digits. */
  async find(text) {
    const names = [];
    const labels = [];
    for await (const { name, label } of this.models()) {
      if (label === text || name.slice(MODELS.length).startsWith(text)) names.push(name);
      if (label) labels.push(label);
    }
    if (names.length === 1) return names[0];
    if (names.length) {
      throw new CarillonError('NAME_AMBIGUOUS', `'${text}' means ${names.length} of the models, for instance ` +
        `${names[0]} and ${names[1]}; give more digits of the digest`);
    }
    const near = nearest(text, labels);
    throw new CarillonError('MODAL_MODEL_NOT_FOUND', `no model has the label '${text}' or begins with these digits` +
      (near === undefined ? '' : `; did you mean '${near}'?`));
  }

  /**
   * Changes the gain of the daemon's output, or mutes it, without a click. The gain is linear: 1 leaves the level as it
   * is, and 10 ** (x / 20) stands for x decibels. Returns both.
   */
  setVolume(volume) {
    refuseUnknown(volume, ['gain', 'muted'], 'setVolume');
    const { gain, muted } = volume;
    refuseNoNumbers({ gain }, 'setVolume');
    return this.call('AudioService', 'UpdateMixer', { ...given('gain', gain), ...given('muted', muted) });
  }

  /** Fades out all that sounds in your scenes. Returns their number. */
  async stopAll() {
    return (await this.call('SceneService', 'StopAll', {})).sceneCount;
  }

  /**
   * Makes an empty scene. It ends by itself a minute after its clients, unless `keep` is true. With an `id`, a scene that
   * you made before with this id and the same settings is returned as it is, and its `existing` is true. A HearingWarning
   * tells of a `hearing` with panning or two ears whose daemon plays one channel.
   */
  async createScene(settings = {}) {
    refuseUnknown(settings, ['hearing', 'listener', 'gain', 'keep', 'id'], 'createScene', 'CreateSceneRequest');
    const { hearing, listener, gain, keep = false, id } = settings;
    if (hearing) refuseNoMessage(hearing, 'Hearing', 'hearing');
    refuseNoNumbers({ gain }, 'createScene');
    const request = { ...given('hearing', hearing), ...given('listener', toPose(listener, 'listener')),
      ...given('gain', gain), keep, ...given('id', id) };
    const made = await this.call('SceneService', 'CreateScene', request);
    if (hearing?.panning || hearing?.binaural) await this.warnOfOneChannel(made.name);
    return new Scene(this, made.name, made.existing);
  }

  /** Warns if the daemon plays one channel. A caller who may not ask for its output gets no warning. */
  async warnOfOneChannel(scene) {
    try {
      if ((await this.status()).format.channelCount === 1) warnOfOneChannel(scene);
    } catch (error) {
      if (!(error instanceof CarillonError)) throw error;
    }
  }

  /** Returns all scenes of the daemon, the oldest first. */
  async scenes() {
    return (await this.call('SceneService', 'ListScenes', {})).scenes.map((scene) => new Scene(this, scene.name));
  }

  /**
   * Renders a trace, or a .contacts file, faster than real time. `settings` are fields of RenderSettings. Throws
   * CarillonError if a contact is rejected, or if there is none (TRACE_EMPTY). Renderings wait for each other where the
   * daemon would refuse so many of one client.
   */
  async render(trace, settings = {}) {
    refuseNoMessage(settings, 'RenderSettings', 'render');
    const whole = trace instanceof Trace ? trace : await Trace.read(trace);
    this.renderings ??= mostRenderings(this).then((count) => new Places(count));
    const places = await this.renderings.catch((error) => {
      this.renderings = undefined; // A later rendering asks again.
      throw error;
    });
    return places.use(() => this.renderTrace(whole, settings));
  }

  /**
   * Performs environments that are simulated in step: each step gives its samples before the next. `settings` are step,
   * the duration of a step in seconds, and environments, microphones such as { kind: 'omni', pose: [0, 0, 1.5] }, latency
   * in seconds, frame, pulseShape, sampleRateHz, fullScalePa, hearing and tellImpacts.
   */
  perform(settings) {
    return new Performance(this, settings).begin();
  }

  async renderTrace(whole, settings) {
    const stream = this.stub('AudioService').Render();
    stream.write({ settings });
    for (const record of whole.records()) stream.write({ record });
    stream.end();
    const pieces = [];
    const blows = [];
    let format;
    let summary;
    for await (const answer of this.answers(stream)) {
      if (answer.response === 'format') format = answer.format;
      else if (answer.response === 'block') pieces.push(answer.block.samples);
      else if (answer.response === 'blows') blows.push(...answer.blows.blows);
      else summary = answer.summary;
    }
    if (summary.rejectedCount) throw fromInfo(summary.lastRejection);
    const empty = summary.warnings.find(({ id }) => id === 'TRACE_EMPTY');
    if (empty) throw new CarillonError(empty.id, empty.text);
    warnOfContacts(summary.warnings);
    if (summary.paperCouplingObjectCount) {
      await this.warnOfTransfers(whole.objects.map((object) => object.modalModel), "the sound is by the paper's coupling, " +
        'and the same rendering will sound different later');
    }
    return new Sound(samplesOf(pieces), format.sampleRateHz, format.channelCount, summary, blows);
  }

  /**
   * Warns if transfers of the models are being computed, and says how the objects sound meanwhile. A caller who may not
   * list jobs gets no warning.
   */
  async warnOfTransfers(models, meanwhile) {
    const labels = [];
    try {
      for await (const job of this.jobs({ states: ['queued', 'running'] })) {
        if (isTransfer(job) && models.includes(job.modalModel)) labels.push(job.label || job.name);
      }
    } catch (error) {
      if (!(error instanceof CarillonError)) throw error;
    }
    if (labels.length) warnOfTransfers(labels, meanwhile);
  }

  /**
   * Begins to record what the daemon plays. Returns once it does. `request` has fields of ListenRequest: scene,
   * blockFrameCount and encoding.
   */
  async listen(request = {}) {
    refuseNoMessage(request, 'ListenRequest', 'listen');
    const stream = this.stub('AudioService').Listen(request);
    const answers = this.answers(stream);
    const { value } = await answers.next();
    return new Recording(stream, answers, value.format);
  }

  [util.inspect.custom]() {
    return `<Client of ${this.server}>`;
  }

  /** Cancels streams that were not closed, recordings and renderings, and ends the connection after the other calls. */
  close() {
    this.isClosed = true;
    for (const call of this.openCalls) call.cancel();
    for (const stub of this.stubs.values()) stub.close();
  }
}

/**
 * What the daemon plays, from the call of Client.listen on: in pieces of any length by `take`, or, with `for await`, in
 * blocks as they come. Leaving the loop, or `stop`, ends the recording.
 */
class Recording {
  constructor(stream, answers, format) {
    this.stream = stream;
    this.answers = answers;
    this.format = format;
    this.pieces = []; // what was heard and not taken, as bytes
    this.byteCount = 0;
    this.lostFrameCount = 0;
  }

  /** Waits for the next answer. Returns false after the last one. */
  async hear() {
    const { value, done } = await this.answers.next();
    if (done) return false;
    this.pieces.push(value.block.samples);
    this.byteCount += value.block.samples.length;
    this.lostFrameCount = value.lostFrameCount;
    return true;
  }

  /** The first bytes of what was heard, as a Sound. */
  cut(byteCount) {
    const heard = Buffer.concat(this.pieces);
    this.pieces = [heard.subarray(byteCount)];
    this.byteCount = this.pieces[0].length;
    const samples = this.isShort ? samplesOfIntegers : samplesOf;
    const { sampleRateHz: rateHz, channelCount } = this.format;
    return new Sound(samples([heard.subarray(0, byteCount)]), rateHz, channelCount);
  }

  get isShort() {
    return this.format.encoding === 'AUDIO_ENCODING_INT16';
  }

  /**
   * Waits for the next seconds of the sound, and returns them: the first call from the beginning of the recording on, and
   * each further call from where the one before ended, without a gap. A sound that ends before, since its scene was
   * deleted, is shorter.
   */
  async take(seconds) {
    if (!(seconds > 0 && seconds < Infinity)) refuse(seconds, 'seconds', 'a number above 0');
    const { sampleRateHz: rateHz, channelCount } = this.format;
    const wanted = Math.floor(seconds * rateHz) * channelCount * (this.isShort ? 2 : 4);
    while (this.byteCount < wanted && await this.hear());
    return this.cut(wanted);
  }

  /** Yields the sound in blocks as they come, until the loop is left or the scene is deleted. */
  async* [Symbol.asyncIterator]() {
    try {
      do {
        if (this.byteCount) yield this.cut(this.byteCount);
      } while (await this.hear());
    } finally {
      await this.stop();
    }
  }

  /** Ends the recording. A take that waits throws CarillonError (CANCELLED). */
  async stop() {
    this.stream.cancel();
    await this.answers.return();
  }
}

module.exports = { Client, connect };
