// SPDX-License-Identifier: Apache-2.0
// A contact trace with its sound, and where it is being played. Neither the daemon nor the console is needed for it.
import { computed, signal } from '@preact/signals';
import { create, fromBinary } from '@bufbuild/protobuf';
import { BinaryReader } from '@bufbuild/protobuf/wire';
import type { Blow, RenderSummary } from './gen/carillon/v1/audio_service_pb';
import { PoseSchema } from './gen/carillon/v1/contact_pb';
import type { ContactTraceRecord } from './gen/carillon/v1/contact_trace_pb';
import { ContactTraceRecordSchema } from './gen/carillon/v1/contact_trace_pb';
import type { Scene, SoundingObject } from './gen/carillon/v1/scene_service_pb';
import { SceneSchema, SoundingObjectSchema } from './gen/carillon/v1/scene_service_pb';

/** Poses of a body in order of time: seconds of the sound, and x, y, z, m, with the quaternion w, x, y, z. */
interface Track { timesS: number[]; poses: number[][] }

/** What moves in a trace. */
export interface Motion {
  objects: SoundingObject[];
  labels: Map<number, string>;
  tracks: Map<number, Track>;
  scene: Scene;
}

export interface Trace extends Motion {
  name: string;
  /** A WAV file of the whole sound. */
  wave: Blob;
  sound: AudioBuffer;
  blows: Blow[];
  summary: RenderSummary;
}

export const trace = signal<Trace | undefined>(undefined);
export const playing = signal(false);
export const loop = signal(false);
export const timeS = signal(0);

let context: AudioContext | undefined;
let source: AudioBufferSourceNode | undefined;

/** The objects at their poses at the playhead. */
export const objects = computed(() => trace.value?.objects.map((object) => {
  const track = trace.value!.tracks.get(object.handle);
  const at = track?.timesS.findLastIndex((time) => time <= timeS.value) ?? -1;
  const pose = track?.poses[Math.max(at, 0)];
  if (!pose) return object;
  const [x, y, z, w, i, j, k] = pose as [number, number, number, number, number, number, number];
  return { ...object, pose: create(PoseSchema, { positionM: { x, y, z }, orientation: { w, x: i, y: j, z: k } }) };
}) ?? []);

/** The records of a .contacts file. */
export function recordsIn(bytes: Uint8Array): ContactTraceRecord[] {
  const reader = new BinaryReader(bytes);
  const records: ContactTraceRecord[] = [];
  while (reader.pos < reader.len) records.push(fromBinary(ContactTraceRecordSchema, reader.bytes()));
  return records;
}

export function motionOf(records: ContactTraceRecord[]): Motion {
  const scene = create(SceneSchema, { name: 'trace' });
  const motion: Motion = { objects: [], labels: new Map(), tracks: new Map(), scene };
  let shiftS = 0;
  for (const { record } of records) {
    if (record.case === 'header') {
      const { clock, hearing, listener } = record.value;
      Object.assign(scene, { hearing, listener });
      // The sound of a trace with a clock begins at the arrival of its first step.
      if (clock) shiftS = clock.schedulingDelayS - clock.firstTimeS;
    } else if (record.case === 'object') {
      const { handle, modalModel, size, label, pose } = record.value;
      motion.objects.push(create(SoundingObjectSchema, { name: `trace/${handle}`, handle, modalModel, size: size || 1, pose }));
      motion.labels.set(handle, label || `body ${handle}`);
    } else if (record.case === 'step' && record.value.poses) {
      const { timeS: time, poses: { object, positionM, orientation } } = record.value;
      object.forEach((handle, i) => {
        const track = motion.tracks.get(handle) ?? { timesS: [], poses: [] };
        const turn = orientation.slice(4 * i, 4 * i + 4);
        track.timesS.push(time + shiftS);
        track.poses.push([...positionM.slice(3 * i, 3 * i + 3), ...(turn.some(Boolean) ? turn : [1, 0, 0, 0])]);
        motion.tracks.set(handle, track);
      });
    }
  }
  return motion;
}

/** The samples of a WAV file, at its own rate. */
export async function soundOf(wave: Blob): Promise<AudioBuffer> {
  const bytes = await wave.arrayBuffer();
  return new OfflineAudioContext(1, 1, new DataView(bytes).getUint32(24, true)).decodeAudioData(bytes);
}

/** Plays from a time on; a gesture of the user must have led here. */
export function play(from = timeS.value): void {
  const { sound } = trace.value!;
  stop();
  context ??= new AudioContext();
  source = new AudioBufferSourceNode(context, { buffer: sound, loop: loop.value });
  // Levels are physical, and most bodies are soft.
  const peak = Array.from({ length: sound.numberOfChannels }, (_, i) => sound.getChannelData(i)
    .reduce((most, sample) => Math.max(most, Math.abs(sample)), 1e-6)).reduce((a, b) => Math.max(a, b));
  source.connect(new GainNode(context, { gain: 0.9 / peak })).connect(context.destination);
  const offsetS = from >= sound.duration ? 0 : from;
  const startedS = context.currentTime;
  source.start(0, offsetS);
  playing.value = true;
  const played = source;
  const follow = () => {
    if (source !== played) return;
    const time = offsetS + context!.currentTime - startedS;
    timeS.value = loop.value ? time % sound.duration : Math.min(time, sound.duration);
    if (!loop.value && time >= sound.duration) stop();
    else requestAnimationFrame(follow);
  };
  follow();
}

export function stop(): void {
  source?.stop();
  source = undefined;
  playing.value = false;
}

export const toggle = () => (playing.value ? stop() : play());

export function seek(to: number): void {
  timeS.value = Math.max(0, Math.min(to, trace.value!.sound.duration));
  if (playing.value) play(timeS.value);
}

export function setLoop(wanted: boolean): void {
  loop.value = wanted;
  if (playing.value) play();
}
