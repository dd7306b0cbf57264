// SPDX-License-Identifier: Apache-2.0
// Plays the ring. The browser takes several quanta at once, as many as its own buffer holds; the target is what the ring
// still holds then, and thus how late the next block of the daemon may be. The daemon's clock and the sound card's differ
// by some 100 ppm, so the reader moves at a ratio near 1 that keeps the target, through a windowed sinc.
import { Ring, RING_FRAMES } from './ring';

declare const sampleRate: number;
declare const currentFrame: number;
declare const registerProcessor: (name: string, processor: unknown) => void;
declare class AudioWorkletProcessor { readonly port: MessagePort; }

const TAPS = 32, PHASES = 512, QUANTUM = 128;
const FIRST_TARGET = 512, LEAST_TARGET = 512, MORE = 256;
/** What the machine kept from running once, it soon keeps from running again: each gap doubles the time without one. */
const CALM_S = 10;
const MOST_RATIO_CHANGE = 0.004, GAIN = 2e-6, SMOOTHING = 0.02;
/** Frames beyond the target that are left out at once: the ratio would take minutes. */
const MOST_EXCESS = 4096;

/** PHASES + 1 rows of TAPS weights: a sinc under a Blackman window, each row of sum 1. */
function sincTable(): Float32Array {
  const table = new Float32Array((PHASES + 1) * TAPS);
  for (let phase = 0; phase <= PHASES; phase += 1) {
    let sum = 0;
    for (let tap = 0; tap < TAPS; tap += 1) {
      const x = tap - TAPS / 2 + 1 - phase / PHASES;
      const u = (x + TAPS / 2) / TAPS;
      const window = 0.42 - 0.5 * Math.cos(2 * Math.PI * u) + 0.08 * Math.cos(4 * Math.PI * u);
      const weight = (Math.abs(x) < 1e-9 ? 1 : Math.sin(Math.PI * x) / (Math.PI * x)) * window;
      table[phase * TAPS + tap] = weight;
      sum += weight;
    }
    for (let tap = 0; tap < TAPS; tap += 1) table[phase * TAPS + tap]! /= sum;
  }
  return table;
}

class Player extends AudioWorkletProcessor {
  private ring?: Ring;
  /** The frames that the browser takes at once. */
  private burst = QUANTUM;
  private readonly table = sincTable();
  private target = FIRST_TARGET;
  private fraction = 0;
  private smoothed = FIRST_TARGET;
  private playing = false;
  private adapt = true;
  private tap = false;
  private leastSlack = Infinity;
  private calm = 0;
  private calmS = CALM_S;

  constructor() {
    super();
    this.port.onmessage = (event) => {
      const { memory, channels, burst, adapt, tap } = event.data;
      if (memory) {
        this.ring = new Ring(memory, channels);
        this.burst = burst;
        this.playing = false;
      }
      if (adapt !== undefined) {
        this.adapt = adapt;
        this.fraction = 0;
      }
      if (tap !== undefined) this.tap = tap;
    };
  }

  process(_inputs: Float32Array[][], outputs: Float32Array[][]): boolean {
    const output = outputs[0]!;
    const frames = output[0]!.length;
    const ring = this.ring;
    if (!ring) return true;
    let fill = ring.fill();
    // Before a quantum the ring holds on average what is due before the middle one of those that are taken at once.
    const wanted = this.target + (this.burst + QUANTUM) / 2;
    if (!this.playing) {
      if (fill < this.target + this.burst) return true;
      ring.release(fill - this.target - this.burst);
      fill = this.target + this.burst;
      this.playing = true;
      this.smoothed = wanted;
      this.port.postMessage({ playing: true, target: this.target });
    }
    if (fill > wanted + MOST_EXCESS) {
      ring.release(fill - wanted);
      fill = this.smoothed = wanted;
    }
    this.smoothed += SMOOTHING * (fill - this.smoothed);
    const change = GAIN * (this.smoothed - wanted);
    const ratio = this.adapt ? 1 + Math.max(-MOST_RATIO_CHANGE, Math.min(MOST_RATIO_CHANGE, change)) : 1;
    if (fill < frames * ratio + TAPS + 1) return this.underrun(output);
    this.read(ring, output, ratio);
    this.relax(fill - frames - TAPS, frames);
    if (this.tap) this.port.postMessage({ samples: output[0]!.slice(), frame: currentFrame });
    return true;
  }

  private read(ring: Ring, output: Float32Array[], ratio: number): void {
    const frames = output[0]!.length, { samples, channels } = ring, { table } = this;
    const mask = RING_FRAMES - 1, tail = ring.read() & mask;
    let place = this.fraction;
    for (let i = 0; i < frames; i += 1) {
      const whole = Math.floor(place), first = tail + whole;
      const row = Math.round((place - whole) * PHASES) * TAPS;
      for (let channel = 0; channel < output.length; channel += 1) {
        let sum = 0;
        const source = Math.min(channel, channels - 1);
        if (ratio === 1 && row === 0) sum = samples[((first + TAPS / 2 - 1) & mask) * channels + source]!;
        else for (let tap = 0; tap < TAPS; tap += 1) sum += table[row + tap]! * samples[((first + tap) & mask) * channels + source]!;
        output[channel]![i] = sum;
      }
      place += ratio;
    }
    const read = Math.floor(place);
    ring.release(read);
    this.fraction = place - read;
  }

  private underrun(output: Float32Array[]): boolean {
    for (const channel of output) channel.fill(0);
    this.playing = false;
    this.target += MORE;
    this.calm = 0;
    this.calmS *= 2;
    this.port.postMessage({ underrun: true, target: this.target });
    return true;
  }

  /** After a calm time, lowers the target as far as a slack of MORE would have been left, in steps that no ear hears as pitch. */
  private relax(slack: number, frames: number): void {
    this.leastSlack = Math.min(this.leastSlack, slack);
    this.calm += frames;
    if (this.calm < this.calmS * sampleRate) return;
    const less = Math.min(this.leastSlack - MORE, this.target - LEAST_TARGET, 2 * MORE);
    if (less > 0) {
      this.target -= less;
      this.port.postMessage({ target: this.target });
    }
    this.calm = 0;
    this.leastSlack = Infinity;
  }
}

registerProcessor('carillon-player', Player);
