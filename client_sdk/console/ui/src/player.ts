// SPDX-License-Identifier: Apache-2.0
import type { ListenNews } from './listen_worker';
import { Ring } from './ring';

/** Latencies to ask of the browser, s. 0 is its least, 11 ms in Chromium, at which a busy machine has gaps. */
const LATENCIES_S = [0, 0.01, 0.02, 0.04];
/** More gaps of the browser's own in this time ask for the next latency. */
const WATCH_MS = 10000, MOST_GAPS = 1;

/** Plays the daemon's sound, or that of one scene, in the browser. */
export class Player {
  context?: AudioContext;
  analyser?: AnalyserNode;
  node?: AudioWorkletNode;
  /** How often the ring was empty. */
  underruns = 0;
  /** The frames that still wait when the browser has taken some; what is later than they last is a gap. */
  target = 0;
  lostFrames = 0;
  /** Gets what the audio thread plays after observe({ tap: true }). */
  onSamples: (samples: Float32Array, frame: number) => void = () => {};
  private ring?: Ring;
  private origin?: number;
  private format?: Extract<ListenNews, { kind: 'format' }>;
  private latency = 0;
  private isObserved = false;
  /** The browser's own gaps: of contexts before this one, and of this one when they were last looked at. */
  private gapsBefore = 0;
  private gapsSeen = 0;
  private watch?: ReturnType<typeof setInterval>;
  private worker?: Worker;
  private volume?: GainNode;
  private gainDb = 24;
  private playing = () => {};

  constructor(private readonly changed: () => void = () => {}) {}

  /**
   * Plays the output, or a scene ("scenes/..."). Must be called by a gesture of the user, or the browser plays nothing.
   * Resolves when sound arrives at the audio thread.
   */
  start(scene = ''): Promise<void> {
    this.worker = new Worker(new URL('./listen_worker.js', import.meta.url), { type: 'module' });
    const { worker } = this;
    const ready = new Promise<void>((resolve) => { this.playing = resolve; });
    worker.onmessage = async ({ data }: MessageEvent<ListenNews>) => {
      if (data.kind === 'lost') this.lostFrames = data.frames;
      else if (data.kind === 'clock') this.origin = data.origin;
      else await this.play(data);
      this.changed();
    };
    worker.postMessage({ scene });
    return ready;
  }

  /** How often nothing was played that should have been: because the ring was empty, or because the browser was late itself. */
  get gaps(): number {
    return this.underruns + this.browserGaps;
  }

  /** Those gaps that are the browser's own. */
  get browserGaps(): number {
    return this.gapsBefore + this.gapsOfContext();
  }

  /** Chromium counts them; TypeScript does not know it yet. */
  private gapsOfContext(): number {
    const context: Partial<AudioContext & { playbackStats: { underrunEvents: number } }> = this.context ?? {};
    return context.playbackStats?.underrunEvents ?? 0;
  }

  /** The time of the mixer's frame that the audio thread plays now, s, as blows have it. */
  playedS(): number | undefined {
    if (!this.context || !this.ring || this.origin === undefined) return undefined;
    return (this.origin + this.ring.read()) / this.context.sampleRate;
  }

  /**
   * For tests and for pages that record, once it plays: `tap` lets onSamples have what the audio thread plays, and
   * without `adapt` that has the daemon's rate. The browser's latency then stays as it is.
   */
  observe(settings: { tap?: boolean; adapt?: boolean }): void {
    this.isObserved = true;
    this.node!.port.postMessage(settings);
  }

  async stop(): Promise<void> {
    const { worker, context } = this;
    clearInterval(this.watch);
    this.gapsBefore = this.browserGaps;
    this.context = this.analyser = this.node = this.worker = this.ring = this.origin = undefined;
    worker?.terminate();
    await context?.close();
    this.changed();
  }

  /** The volume in this browser, dB. A limiter follows it. */
  set volumeDb(db: number) {
    this.gainDb = db;
    this.volume?.gain.setTargetAtTime(10 ** (db / 20), this.context!.currentTime, 0.02);
  }

  get volumeDb(): number {
    return this.gainDb;
  }

  /** Asks for the next latency if the browser was late too often. */
  private adjustLatency(): void {
    const gaps = this.gapsOfContext(), more = gaps - this.gapsSeen;
    this.gapsSeen = gaps;
    if (this.isObserved || more <= MOST_GAPS || this.latency + 1 === LATENCIES_S.length || !this.format) return;
    this.latency += 1;
    void this.play(this.format, true);
  }

  private async play(format: Extract<ListenNews, { kind: 'format' }>, anew = false): Promise<void> {
    this.format = format;
    if (anew || this.context?.sampleRate !== format.sampleRateHz) {
      clearInterval(this.watch);
      this.gapsBefore = this.browserGaps;
      this.gapsSeen = 0;
      void this.context?.close();
      this.context = new AudioContext({ sampleRate: format.sampleRateHz, latencyHint: LATENCIES_S[this.latency] });
      this.watch = setInterval(() => this.adjustLatency(), WATCH_MS);
      const { context } = this;
      await context.audioWorklet.addModule(new URL('./player_worklet.js', import.meta.url));
      if (this.context !== context) return;
      this.connect(context, format.channels);
    }
    this.ring = new Ring(format.memory, format.channels);
    const burst = Math.round(this.context.baseLatency * this.context.sampleRate);
    this.node!.port.postMessage({ memory: format.memory, channels: format.channels, burst });
    await this.context!.resume();
  }

  private connect(context: AudioContext, channels: number): void {
    this.node = new AudioWorkletNode(context, 'carillon-player', { numberOfInputs: 0, outputChannelCount: [channels] });
    this.node.port.onmessage = ({ data }) => {
      if (data.playing) this.playing();
      if (data.underrun) this.underruns += 1;
      if (data.target) this.target = data.target;
      if (data.samples) this.onSamples(data.samples, data.frame);
      else this.changed();
    };
    this.analyser = new AnalyserNode(context, { fftSize: 4096, minDecibels: -130, maxDecibels: -40, smoothingTimeConstant: 0 });
    this.volume = new GainNode(context, { gain: 10 ** (this.gainDb / 20) });
    const limiter = new DynamicsCompressorNode(context, { threshold: -3, knee: 0, ratio: 20, attack: 0.001, release: 0.1 });
    this.node.connect(this.analyser).connect(this.volume).connect(limiter).connect(context.destination);
  }
}
