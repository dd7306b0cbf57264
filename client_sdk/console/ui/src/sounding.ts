// SPDX-License-Identifier: Apache-2.0
// The one player of the page, which all its views share.
import { signal } from '@preact/signals';
import { Player } from './player';
import { mixer, reached, sceneName } from './state';

/** Counts changes of the player, so that views follow them. */
export const playerChanged = signal(0);
export const player = new Player(() => { playerChanged.value += 1; });
export const sounding = signal(false);
/** The scene that is heard here; empty for the output. */
export const heardScene = signal('');
let declined = false;
let ready = Promise.resolve();

export async function toggleSound(): Promise<void> {
  declined = sounding.value;
  if (sounding.value) await silence();
  else sound(heardScene.value);
}

export function sound(scene: string): void {
  heardScene.value = scene;
  sounding.value = true;
  ready = player.start(scene);
}

async function silence(): Promise<void> {
  sounding.value = false;
  await player.stop();
}

/** Hears another scene, if anything is heard. */
export async function hear(scene: string): Promise<void> {
  if (heardScene.value === scene) return;
  heardScene.value = scene;
  if (!sounding.value) return;
  await silence();
  sound(scene);
}

export const gapsOf = (count: number) => `${count} ${count === 1 ? 'gap' : 'gaps'}`;

/** Whether the daemon plays on a sound card itself. */
export const hasDevice = () => !/^(null|file)/.test(mixer.value?.device ?? 'null');

/** Lets the page sound at the user's first gesture, unless the daemon sounds itself or the user said no. */
export function soundByGesture(event?: Event): void {
  // These buttons turn the sound on, or off again, by themselves.
  if (event?.target instanceof Element && event.target.closest('button.sound')) return;
  if (reached.value && sceneName() && !sounding.value && !declined && !hasDevice()) sound('');
}

/** Resolves once sound arrives, or after a second. */
export function soundReady(): Promise<unknown> {
  return Promise.race([ready, new Promise((resolve) => setTimeout(resolve, 1000))]);
}
