// SPDX-License-Identifier: Apache-2.0
'use strict';

const util = require('util');
const { counted, refuseNoNumbers, refuseUnknown } = require('./checks');
const { strikeOf } = require('./contacts');
const { Trace } = require('./traces');

/**
 * A modal model in the daemon's database. `material` is the one that it was made with, undefined if it was imported;
 * `summary` is the message that describes the model.
 */
class Model {
  constructor(client, summary, material) {
    this.client = client;
    this.summary = summary;
    this.material = material;
  }

  get name() {
    return this.summary.name;
  }

  get label() {
    return this.summary.label;
  }

  get modeCount() {
    return this.summary.header.modeCount;
  }

  /**
   * Waits until the daemon has computed how the model radiates, which it begins when the model is stored. Before that,
   * objects sound by the paper's coupling, at other levels and without damping by radiation. Returns at once if no
   * transfer of the model is being computed. Throws CarillonError if the computation failed, or if it has not ended after
   * `timeout` seconds (DEADLINE_EXCEEDED).
   */
  async waitForTransfer(options = {}) {
    refuseUnknown(options, ['timeout', 'onProgress'], 'waitForTransfer');
    const { timeout, onProgress } = options;
    refuseNoNumbers({ timeout }, 'waitForTransfer');
    const end = timeout === undefined ? undefined : Date.now() + 1000 * timeout;
    for (const job of await this.transferJobs()) {
      const rest = end === undefined ? undefined : Math.max(0, end - Date.now()) / 1000;
      await this.client.watch(job, onProgress, rest);
    }
    this.summary = (await this.client.model(this.name)).summary;
  }

  /**
   * The jobs whose end decides whether the model has a transfer: those that wait or run, or else the newest one that did
   * not succeed, if no transfer is stored.
   */
  async transferJobs() {
    const found = [];
    for await (const job of this.client.jobs({ states: ['queued', 'running', 'failed', 'cancelled'] })) {
      if (isTransfer(job) && job.modalModel === this.name) found.push(job);
    }
    const awaited = found.filter((job) => ['JOB_STATE_QUEUED', 'JOB_STATE_RUNNING'].includes(job.state));
    if (awaited.length) return awaited;
    return (await this.client.model(this.name)).summary.transfers.length ? [] : found.slice(0, 1);
  }

  /**
   * Renders one strike without a scene and faster than real time. The samples are the same each time once the transfer of
   * the model is computed (waitForTransfer). `seconds` zero means until the sound has died away.
   */
  async renderStrike(strike = {}) {
    refuseUnknown(strike, ['point', 'impulse', 'duration', 'striker', 'material', 'size', 'gain', 'seconds',
      'sampleRateHz'], 'renderStrike');
    const { material, size, gain, seconds = 0, sampleRateHz = 48000 } = strike;
    refuseNoNumbers({ size, gain, seconds, sampleRateHz }, 'renderStrike');
    const trace = new Trace({ simulator: 'carillon (Node)' });
    const object = trace.add(this, { material, size, gain });
    trace.step(0, { impacts: strikeOf(object, strike) });
    return this.client.render(trace, { tailS: seconds, sampleRateHz });
  }

  [util.inspect.custom]() {
    return `<Model ${this.label || this.name}: ${counted(this.modeCount, 'mode')}>`;
  }
}

/** Whether a job computes how a stored model radiates, and not a model. */
function isTransfer(job) {
  return job.kind === 'JOB_KIND_TRANSFER';
}

module.exports = { Model, isTransfer };
