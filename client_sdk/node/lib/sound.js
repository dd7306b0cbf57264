// SPDX-License-Identifier: Apache-2.0
'use strict';

const fs = require('fs/promises');
const util = require('util');
const { counted } = require('./checks');

const FULL_SCALE = 2 ** 23 - 1;

/**
 * Samples as a Float32Array, interleaved by channel; full scale is 1. `summary` is what the daemon measured while it
 * rendered the sound offline. `blows` are the impulses that sounded, if the settings had tellBlows.
 */
class Sound {
  constructor(samples, sampleRateHz, channelCount, summary, blows = []) {
    this.samples = samples;
    this.sampleRateHz = sampleRateHz;
    this.channelCount = channelCount;
    this.summary = summary;
    this.blows = blows;
  }

  get seconds() {
    return this.samples.length / this.channelCount / this.sampleRateHz;
  }

  get peak() {
    return this.samples.reduce((most, sample) => Math.max(most, Math.abs(sample)), 0);
  }

  [util.inspect.custom]() {
    return `<Sound: ${Number(this.seconds.toPrecision(3))} s, ${this.sampleRateHz} Hz, ` +
      `${counted(this.channelCount, 'channel')}, peak ${Number(this.peak.toPrecision(3))}>`;
  }

  /** Writes a WAV file of 24-bit samples; samples beyond full scale are clipped. */
  async save(path) {
    if (!/(^|\/)[^./]*$|\.wave?$/i.test(path)) throw new TypeError(`${path} must end with .wav, because the file is a WAV file`);
    await fs.writeFile(path, this.waveBytes());
  }

  waveBytes() {
    const size = 3 * this.samples.length;
    const made = Buffer.alloc(44 + size + (size % 2));
    const frameBytes = 3 * this.channelCount;
    made.write('RIFF', 0);
    made.writeUInt32LE(made.length - 8, 4);
    made.write('WAVEfmt ', 8);
    made.writeUInt32LE(16, 16);
    made.writeUInt16LE(1, 20); // samples are integers
    made.writeUInt16LE(this.channelCount, 22);
    made.writeUInt32LE(this.sampleRateHz, 24);
    made.writeUInt32LE(frameBytes * this.sampleRateHz, 28);
    made.writeUInt16LE(frameBytes, 32);
    made.writeUInt16LE(24, 34);
    made.write('data', 36);
    made.writeUInt32LE(size, 40);
    this.samples.forEach((sample, i) => {
      made.writeIntLE(Math.round(Math.max(-1, Math.min(1, sample)) * FULL_SCALE), 44 + 3 * i, 3);
    });
    return made;
  }
}

/** The samples of an AudioBlock's bytes, which need not be aligned. */
function samplesOf(pieces) {
  const bytes = Buffer.concat(pieces);
  return new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
}

/** The same of integers of 16 bits. */
function samplesOfIntegers(pieces) {
  const bytes = Buffer.concat(pieces);
  return Float32Array.from({ length: bytes.length / 2 }, (_, i) => bytes.readInt16LE(2 * i) / 32767);
}

module.exports = { Sound, samplesOf, samplesOfIntegers };
