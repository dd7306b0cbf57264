// SPDX-License-Identifier: Apache-2.0
'use strict';

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
  async renderStrike({ point, impulse, duration, striker, material, size, gain, seconds = 0, sampleRateHz = 48000 }) {
    const trace = new Trace({ simulator: 'carillon (Node)' });
    const object = trace.add(this, { material, size, gain });
    trace.step(0, { impulses: [{ object, point, impulse, duration, striker }] });
    return this.client.render(trace, { tail_s: seconds, sample_rate_hz: sampleRateHz });
  }
}

module.exports = { Model };
