// SPDX-License-Identifier: Apache-2.0
'use strict';

const util = require('util');
const { counted, refuseUnknown } = require('./checks');
const { strikeOf } = require('./contacts');
const { inNames } = require('./errors');
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
    return this.summary.header.mode_count;
  }

  /**
   * Renders one strike without a scene and faster than real time, the same samples each time. `seconds` zero means
   * until the sound has died away.
   */
  async renderStrike(strike = {}) {
    refuseUnknown(strike, ['point', 'impulse', 'duration', 'striker', 'material', 'size', 'gain', 'seconds',
      'sampleRateHz'], 'renderStrike');
    const { material, size, gain, seconds = 0, sampleRateHz = 48000 } = strike;
    const trace = new Trace({ simulator: 'carillon (Node)' });
    const object = trace.add(this, { material, size, gain });
    trace.step(0, { impulses: strikeOf(object, strike) });
    return inNames({ tail_s: 'seconds', sample_rate_hz: 'sampleRateHz' },
      this.client.render(trace, { tail_s: seconds, sample_rate_hz: sampleRateHz }));
  }

  [util.inspect.custom]() {
    return `<Model ${this.label || this.name}: ${counted(this.modeCount, 'mode')}>`;
  }
}

module.exports = { Model };
