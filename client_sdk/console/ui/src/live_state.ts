// SPDX-License-Identifier: Apache-2.0
// What runs in the scenes of other programs, as signals.
import { computed, effect, signal } from '@preact/signals';
import type { Blow } from './gen/carillon/v1/audio_service_pb';
import type { StreamContactsResponse } from './gen/carillon/v1/contact_service_pb';
import type { Scene, SoundingObject } from './gen/carillon/v1/scene_service_pb';
import { gapsOf, hasDevice, heardScene, player, playerChanged, sounding } from './sounding';
import * as state from './state';

const POSE_PERIOD_MS = 66, STATE_PERIOD_MS = 500, TELL_PERIOD_MS = 150;
const MOST_BLOWS = 200;
/** A stream that sent a step within this time is running; reports come twice a second. */
const RUNNING_MS = 2500;
/** What is softer is taken for silence; 16 bits end at -96 dBFS. */
const SOFT_DB = -70;
/** What was not struck or not heard for this long is silent now. */
const RECENT_MS = 5000;

export interface SeenBlow { blow: Blow; stream: bigint; seenMs: number }
export interface SeenStream { report: StreamContactsResponse; seenMs: number; ended: boolean }

/** Whether the view is shown; nothing is asked of the daemon while it is not. */
export const watching = signal(false);
/** Unset until the daemon has been asked. */
export const scenes = signal<Scene[] | undefined>(undefined);
export const sceneName = signal('');
/** Whether the user chose the scene, so that another is not chosen for them. */
export const chosenByHand = signal(false);
export const objects = signal<SoundingObject[]>([]);
export const blows = signal<SeenBlow[]>([]);
export const streams = signal<Map<bigint, SeenStream>>(new Map());
/** The blow whose origin is shown. */
export const chosen = signal<SeenBlow | undefined>(undefined);
export const lostCount = signal(0n);
/** When the scene was last loud enough to hear, as far as the page has seen. */
let heardMs = 0;

export const scene = computed(() => scenes.value?.find((one) => one.name === sceneName.value));

/** How far before a place of the spectrogram, whose columns have 85 ms of sound, its blow lies at most. */
const WINDOW_S = 0.25;

/** Chooses the blow that began to sound last before a time of the mixer. */
export function chooseAt(timeS: number): void {
  chosen.value = blows.value.filter(({ blow }) => blow.timeS < timeS + 0.02 && timeS - blow.timeS < WINDOW_S)
    .sort((a, b) => b.blow.timeS - a.blow.timeS)[0];
}

/** The time of the step that made a blow, s after the stream's first step; unknown before the stream's first report, and
 * earlier than it was where the step came late. */
export function stepTimeOf({ blow, stream }: SeenBlow): number | undefined {
  const report = streams.value.get(stream)?.report, rate = state.mixer.value?.format?.sampleRateHz;
  return report?.firstFrame === undefined || !rate ? undefined : blow.timeS - Number(report.firstFrame) / rate - report.schedulingDelayS;
}

/** A stage between a simulator and an ear. */
export interface Link {
  name: string;
  /** A faulty stage lets sound through, but not all of it. */
  state: 'well' | 'faulty' | 'broken' | 'unknown';
  says: string;
  /** What a button beside it does. */
  remedy?: { text: string; act: () => void };
}

const isLoud = (one: Scene) => 20 * Math.log10(one.peak + 1e-9) >= SOFT_DB;
const ago = (ms: number) => `${((Date.now() - ms) / 1000).toFixed(0)} s ago`;

export const decibels = (amplitude: number) => `${(20 * Math.log10(Math.max(amplitude, 1e-9))).toFixed(0)} dBFS`.replace('-', '−');

/** The stages from the stream to the ear; the first broken one is why nothing is heard. */
export const chain = computed<Link[]>(() => {
  playerChanged.value;
  const one = scene.value;
  if (!scenes.value) return [];
  if (!one) return [{ name: 'Scene', state: 'broken', says: 'No scene is there. A simulator makes one when it connects to this daemon.' }];
  return [bodiesOf(one), stepsOf(), contactsOf(), soundOf(one), volumeOf(one), outputOf(), deviceOf(), browserOf()];
});

function bodiesOf(one: Scene): Link {
  return one.objectCount
    ? { name: 'Bodies', state: 'well', says: `${one.objectCount} in ${one.name}` }
    : { name: 'Bodies', state: 'broken', says: 'The scene has no body. The simulator must add objects to it.' };
}

function stepsOf(): Link {
  if (sceneName.value === state.sceneName()) return { name: 'Contact stream', state: 'unknown', says: 'This page strikes in it; it has no simulator.' };
  const running = [...streams.value.values()].filter((stream) => !stream.ended && Date.now() - stream.seenMs < RUNNING_MS);
  const steps = running.reduce((sum, stream) => sum + Number(stream.report.stepCount), 0);
  if (running.length) return { name: 'Contact stream', state: 'well', says: `${running.length} running, ${steps} steps` };
  const known = [...streams.value.values()];
  const last = Math.max(...known.map((stream) => stream.seenMs));
  const came = known.reduce((sum, stream) => sum + Number(stream.report.stepCount), 0);
  return { name: 'Contact stream', state: 'broken', says: known.some((stream) => stream.ended) ? 'It has ended.'
    : came ? `The last of ${came} steps came ${ago(last)}. The simulator is paused, or hangs.`
    : 'No step has come since this page watches. The simulator is paused, or sends to another scene.' };
}

function contactsOf(): Link {
  const sum = (count: (report: StreamContactsResponse) => bigint) =>
    [...streams.value.values()].reduce((total, stream) => total + Number(count(stream.report)), 0);
  const taken = sum((report) => report.acceptedCount) + sum((report) => report.lateCount);
  const rejected = sum((report) => report.rejectedCount), dropped = sum((report) => report.droppedCount);
  const late = sum((report) => report.lateCount), loads = sum((report) => report.findings?.loadCount ?? 0n);
  const counts = `${taken} impulses taken (${late} late), ${rejected} rejected, ${dropped} dropped`;
  const last = [...streams.value.values()].findLast((stream) => stream.report.lastRejection)?.report.lastRejection;
  if (taken && last && rejected) return { name: 'Contacts', state: 'faulty', says: `${counts}. The last rejected: ${last.message}` };
  if (taken) return { name: 'Contacts', state: 'well', says: counts };
  if (last && rejected) return { name: 'Contacts', state: 'broken', says: `All ${rejected} were rejected: ${last.message}` };
  if (!streams.value.size) return { name: 'Contacts', state: 'unknown', says: '' };
  return { name: 'Contacts', state: 'broken', says: loads ? 'All contacts rest, slide or roll; nothing strikes.' : 'The steps have no contacts.' };
}

function soundOf(one: Scene): Link {
  const name = 'Ringing', [last] = blows.value;
  if (objects.value.length && objects.value.every((object) => object.gain === 0)) {
    const all = objects.value.map((object) => object.name);
    return { name, state: 'broken', says: 'The gain of every body is 0.', remedy: { text: 'Set them to 1', act: () => void state.attempt('',
      () => Promise.all(all.map((object) => state.services.scenes.updateObject({ name: object, gain: 1 })))) } };
  }
  if (one.activeModeCount) return { name, state: 'well', says: `${one.activeModeCount} modes` };
  if (!last || one.muted || one.gain === 0) return { name, state: 'unknown', says: 'Nothing rings at this moment.' };
  if (Date.now() - last.seenMs > RECENT_MS) return { name, state: 'broken', says: `Nothing rings: the last blow was ${ago(last.seenMs)}.` };
  if (Date.now() - heardMs < RECENT_MS) return { name, state: 'well', says: `Nothing rings at this moment; the last blow was ${ago(last.seenMs)}.` };
  const largest = Math.max(...blows.value.filter(({ seenMs }) => Date.now() - seenMs < RECENT_MS)
    .map(({ blow: { impulseNewtonSeconds: p } }) => Math.hypot(p?.x ?? 0, p?.y ?? 0, p?.z ?? 0)));
  return { name, state: 'broken', says: `Blows come, but none leaves anything ringing: the largest of the last seconds has ${largest.toPrecision(2)} N s.` };
}

function volumeOf(one: Scene): Link {
  const update = (change: { muted?: boolean; solo?: boolean; gain?: number }) => () => void state.attempt('', () =>
    state.services.scenes.updateScene({ name: one.name, ...change }));
  const name = 'Scene’s volume';
  if (one.muted) return { name, state: 'broken', says: 'The scene is muted.', remedy: { text: 'Unmute', act: update({ muted: false }) } };
  const solo = scenes.value?.find((other) => other.solo);
  if (solo && !one.solo) return { name, state: 'broken', says: `Only ${solo.name} is heard: it is solo.`,
    remedy: { text: 'End solo', act: () => void state.attempt('', () => state.services.scenes.updateScene({ name: solo.name, solo: false })) } };
  if (one.gain === 0) return { name, state: 'broken', says: 'Its gain is 0.', remedy: { text: 'Set it to 1', act: update({ gain: 1 }) } };
  const soft = one.activeModeCount > 0 && !isLoud(one);
  return { name, state: soft ? 'broken' : 'well',
    says: soft ? `It rings, but at ${decibels(one.peak)} it is too soft to hear.` : `gain ${one.gain.toPrecision(3)}, peak ${decibels(one.peak)}`,
    remedy: soft ? { text: '20 dB louder', act: update({ gain: one.gain * 10 }) } : undefined };
}

function outputOf(): Link {
  const mixer = state.mixer.value;
  const name = 'Output';
  if (!mixer) return { name, state: 'broken', says: 'The daemon is not reached.' };
  const update = (change: { muted?: boolean; gain?: number }) => () => void state.attempt('', () => state.services.audio.updateMixer(change));
  if (mixer.muted) return { name, state: 'broken', says: 'It is muted.', remedy: { text: 'Unmute', act: update({ muted: false }) } };
  if (mixer.gain === 0) return { name, state: 'broken', says: 'Its gain is 0.', remedy: { text: 'Set it to 1', act: update({ gain: 1 }) } };
  return { name, state: 'well', says: `gain ${mixer.gain.toPrecision(3)}, peak ${decibels(mixer.peak)}, load ${(100 * mixer.load).toFixed(0)} %, ${mixer.xrunCount} xruns` };
}

function deviceOf(): Link {
  const mixer = state.mixer.value;
  const text = mixer?.deviceMessage ? `${mixer.device}: ${mixer.deviceMessage}` : mixer?.device ?? '';
  if (!hasDevice() && sounding.value) return { name: 'Daemon’s device', state: 'unknown', says: `${text}; this browser plays instead` };
  if (hasDevice()) return { name: 'Daemon’s device', state: 'well', says: text };
  return { name: 'Daemon’s device', state: 'broken', says: `${text}: it plays on no loudspeaker. Hear it in this browser instead.` };
}

function browserOf(): Link {
  const name = 'This browser';
  if (!sounding.value) return { name, state: hasDevice() ? 'unknown' : 'broken', says: 'Sound here is off (the button above).' };
  const heard = heardScene.value || 'the output';
  return { name, state: player.volumeDb ? 'well' : 'unknown', says: `plays ${heard}; ${gapsOf(player.gaps)}, ${player.lostFrames} frames lost` };
}

/** Asks again and again while `active` holds; a daemon that is away is asked later. */
function repeat(periodMs: number, work: () => Promise<void>): void {
  const step = async () => {
    if (watching.value && state.reached.value && !document.hidden) await work().catch(() => {});
    setTimeout(step, periodMs);
  };
  void step();
}

/** The scene of another program that is connected and has bodies, if there is one. */
function likeliest(): Scene | undefined {
  const worth = (one: Scene) => (one.name === state.sceneName() ? 0 : 4) + (one.connectionCount || one.keep ? 2 : 0) + (one.objectCount ? 1 : 0);
  return [...scenes.value!].sort((a, b) => worth(b) - worth(a))[0];
}

repeat(STATE_PERIOD_MS, async () => {
  scenes.value = (await state.services.scenes.listScenes({})).scenes;
  if (scene.value && isLoud(scene.value)) heardMs = Date.now();
  // A simulator that begins later is chosen, too, unless the user has.
  if (!scene.value || (!chosenByHand.value && sceneName.value === state.sceneName())) sceneName.value = likeliest()?.name ?? '';
});

repeat(POSE_PERIOD_MS, async () => {
  if (sceneName.value) objects.value = (await state.services.scenes.listObjects({ scene: sceneName.value })).objects;
});

/** Watches the streams of the chosen scene, until another is chosen. */
async function watch(name: string, signal: AbortSignal): Promise<void> {
  while (!signal.aborted) {
    try {
      for await (const news of state.services.contacts.watchContacts({ scene: name }, { signal })) if (!signal.aborted) take(news);
    } catch {
      // The daemon is away, or the scene is gone.
    }
    await new Promise((resolve) => setTimeout(resolve, STATE_PERIOD_MS));
  }
}

let newBlows: SeenBlow[] = [];
let newStreams = new Map<bigint, SeenStream>();

/** Keeps what a message says until the views are told, which they are less often than messages come. */
function take(news: { stream: bigint; blows: Blow[]; report?: StreamContactsResponse; ended: boolean; lostCount: bigint }): void {
  const seenMs = Date.now();
  newBlows.push(...news.blows.map((blow) => ({ blow, stream: news.stream, seenMs })));
  const known = newStreams.get(news.stream) ?? streams.value.get(news.stream);
  const report = news.report ?? known?.report;
  if (report && (news.report || news.ended)) newStreams.set(news.stream, { report, seenMs: news.report ? seenMs : known!.seenMs, ended: news.ended });
  lostCount.value = news.lostCount;
}

setInterval(() => {
  if (newBlows.length) blows.value = [...newBlows.reverse(), ...blows.value].slice(0, MOST_BLOWS);
  if (newStreams.size) streams.value = new Map([...streams.value, ...newStreams]);
  newBlows = [];
  newStreams = new Map();
}, TELL_PERIOD_MS);

effect(() => {
  const name = sceneName.value;
  if (!watching.value || !name || !state.reached.value) return undefined;
  const stop = new AbortController();
  blows.value = newBlows = [];
  chosen.value = undefined;
  heardMs = 0;
  streams.value = newStreams = new Map();
  void watch(name, stop.signal);
  return () => stop.abort();
});
