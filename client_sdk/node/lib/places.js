// SPDX-License-Identifier: Apache-2.0
/** Places for the calls of which a daemon takes only some of one client at a time. */
'use strict';

const { setTimeout } = require('timers/promises');

// The daemon gives the place of a rendering back a little after its end.
const PAUSES_MS = Array.from({ length: 8 }, (_, i) => 10 * 2 ** i);

/** Returns how many renderings the daemon lets one client have at a time. */
async function mostRenderings(client) {
  const { limits } = await client.info();
  return Math.max(1, Math.floor(limits.renderingCount * limits.clientShare));
}

/** Some places. Who finds none waits for the next that is given back. */
class Places {
  constructor(count) {
    this.free = count;
    this.waiting = [];
  }

  /** Calls a function once there is a place, and gives the place back when its promise has ended. */
  async use(work) {
    if (this.free > 0) this.free -= 1;
    else await new Promise((resolve) => { this.waiting.push(resolve); });
    try {
      return await this.patiently(work);
    } finally {
      const next = this.waiting.shift();
      if (next) next();
      else this.free += 1;
    }
  }

  /** Calls a function again while the daemon refuses it for want of a place. */
  async patiently(work) {
    for (const pause of PAUSES_MS) {
      try {
        return await work();
      } catch (error) {
        if (error.reason !== 'CLIENT_LIMIT_REACHED') throw error;
      }
      await setTimeout(pause);
    }
    return work();
  }
}

module.exports = { Places, mostRenderings };
