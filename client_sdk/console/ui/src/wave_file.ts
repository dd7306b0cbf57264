// SPDX-License-Identifier: Apache-2.0
import type { MessageInitShape } from '@bufbuild/protobuf';
import type { RenderRequestSchema } from './gen/carillon/v1/audio_service_pb';
import type { ContactTraceRecordSchema } from './gen/carillon/v1/contact_trace_pb';
import { ContactKind } from './gen/carillon/v1/contact_pb';
import * as state from './state';
import { services, strikeToRender } from './state';

const FLOAT = 3;
/** The longest tail that the daemon renders, s. */
const LONGEST_S = 120;
const FADE_S = 0.05, CUT_FADE_S = 2;

/** A WAV file of 32-bit float samples. */
export function waveFile(blocks: Uint8Array[], sampleRateHz: number, channels: number): Blob {
  const length = blocks.reduce((sum, block) => sum + block.length, 0);
  const head = new DataView(new ArrayBuffer(44));
  const text = (at: number, word: string) => [...word].forEach((letter, i) => head.setUint8(at + i, letter.charCodeAt(0)));
  text(0, 'RIFF'); head.setUint32(4, 36 + length, true); text(8, 'WAVEfmt ');
  head.setUint32(16, 16, true); head.setUint16(20, FLOAT, true); head.setUint16(22, channels, true);
  head.setUint32(24, sampleRateHz, true); head.setUint32(28, sampleRateHz * channels * 4, true);
  head.setUint16(32, channels * 4, true); head.setUint16(34, 32, true); text(36, 'data'); head.setUint32(40, length, true);
  return new Blob([head, ...blocks.map((block) => new Uint8Array(block))], { type: 'audio/wav' });
}

/** Ends a sound where it has fallen 60 dB below its peak for good, with a fade, which is longer where it still rings. */
function ended(samples: Float32Array, rateHz: number): Float32Array {
  const peak = samples.reduce((most, sample) => Math.max(most, Math.abs(sample)), 0);
  const last = samples.findLastIndex((sample) => Math.abs(sample) > peak / 1000) + 1;
  const rings = samples.length - last < rateHz / 10;
  const kept = samples.slice(0, rings ? samples.length : last + Math.round(FADE_S * rateHz));
  const fade = Math.min(kept.length, Math.round((rings ? CUT_FADE_S : FADE_S) * rateHz));
  for (let i = 1; i <= fade; i += 1) kept[kept.length - i]! *= (i - 1) / fade;
  return kept;
}

/** Renders the last strike, until it has fallen by 60 dB, and saves it under the names of the body and its material. */
export async function saveStrike(): Promise<void> {
  const { point: [px, py, pz], impulse: [x, y, z], striker, ...object } = strikeToRender();
  const name = `${state.nameOf(state.model.value!.summary)}_${state.materialName.value}`;
  // No sum of modes falls more slowly than the slowest of them.
  const tailS = Math.min(LONGEST_S, Math.max(0.5, ...state.modes.value.map((mode) => mode.t60S)) + 0.2);
  async function* trace(): AsyncGenerator<MessageInitShape<typeof RenderRequestSchema>> {
    yield { request: { case: 'settings' as const, value: { tailS } } };
    const records: MessageInitShape<typeof ContactTraceRecordSchema>['record'][] = [
      { case: 'header' as const, value: { formatVersion: 1, simulator: 'carillon-console' } },
      { case: 'object' as const, value: { handle: 1, ...object } },
      { case: 'step' as const, value: { contacts: [{ kind: ContactKind.IMPACT, object: 1,
        location: { case: 'pointM' as const, value: { x: px, y: py, z: pz } },
        action: { case: 'impulseNewtonSeconds' as const, value: { x, y, z } }, hertz: { striker } }] } },
    ];
    for (const record of records) yield { request: { case: 'record' as const, value: { record } } };
  }
  const blocks: Uint8Array[] = [];
  let rate = 48000, channels = 1;
  for await (const { response } of services.audio.render(trace())) {
    if (response.case === 'format') ({ sampleRateHz: rate, channelCount: channels } = response.value);
    if (response.case === 'block') blocks.push(response.value.samples);
  }
  const all = new Uint8Array(await new Blob(blocks.map((block) => new Uint8Array(block))).arrayBuffer());
  const sound = ended(new Float32Array(all.buffer), rate);
  saveAs(waveFile([new Uint8Array(sound.buffer)], rate, channels), `${name.replace(/[^\w.-]+/g, '_')}.wav`);
}

export function saveAs(file: Blob, name: string): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(file);
  link.download = name;
  link.click();
  // The browser reads the address after this function has ended.
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}
