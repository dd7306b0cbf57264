// SPDX-License-Identifier: Apache-2.0
// What the tables of blows say.
import type { Blow } from './gen/carillon/v1/audio_service_pb';

export const newtonSeconds = ({ impulseNewtonSeconds: impulse }: Blow) => Math.hypot(impulse?.x ?? 0, impulse?.y ?? 0, impulse?.z ?? 0);

/** What struck: a body of the scene by its name, or another one by the number that the simulator gave it. */
export const strikerOf = ({ striker: by }: Blow, name: (handle: number) => string) =>
  (by.case === 'otherObject' ? name(by.value) : by.case === 'partner' ? `#${by.value}` : '');
