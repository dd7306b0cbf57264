// SPDX-License-Identifier: Apache-2.0
// A ring of interleaved samples in shared memory, with one writer (the worker) and one reader (the audio thread).

/** Frames; a power of two, so that head and tail may wrap at 2^32. */
export const RING_FRAMES = 32768;
const HEAD = 0, TAIL = 1;

export class Ring {
  readonly samples: Float32Array;
  private readonly places: Int32Array;

  constructor(readonly memory: SharedArrayBuffer, readonly channels: number) {
    this.places = new Int32Array(memory, 0, 2);
    this.samples = new Float32Array(memory, 8, RING_FRAMES * channels);
  }

  static allocate(channels: number): SharedArrayBuffer {
    return new SharedArrayBuffer(8 + 4 * RING_FRAMES * channels);
  }

  /** Frames that are written and not read. */
  fill(): number {
    return (Atomics.load(this.places, HEAD) - Atomics.load(this.places, TAIL)) | 0;
  }

  /** The numbers of all frames written and read, modulo 2^32. */
  written(): number { return Atomics.load(this.places, HEAD) >>> 0; }
  read(): number { return Atomics.load(this.places, TAIL) >>> 0; }

  /** Writes whole frames, and drops those for which there is no place; returns their number. */
  write(samples: Float32Array): number {
    const head = Atomics.load(this.places, HEAD);
    const frames = Math.min(samples.length / this.channels, RING_FRAMES - this.fill());
    for (let i = 0; i < frames * this.channels; i += 1) {
      this.samples[((head & (RING_FRAMES - 1)) * this.channels + i) % this.samples.length] = samples[i]!;
    }
    Atomics.store(this.places, HEAD, (head + frames) | 0);
    return samples.length / this.channels - frames;
  }

  /** Lets go of frames that have been read. */
  release(frames: number): void {
    Atomics.store(this.places, TAIL, (Atomics.load(this.places, TAIL) + frames) | 0);
  }
}
