// SPDX-License-Identifier: Apache-2.0
import type { MessageInitShape } from '@bufbuild/protobuf';
import type { RenderRequestSchema } from './gen/carillon/v1/audio_service_pb';
import type { ContactTraceRecordSchema } from './gen/carillon/v1/contact_trace_pb';
import { ContactKind } from './gen/carillon/v1/contact_pb';
import * as state from './state';
import { services, strikeToRender } from './state';

const FLOAT = 3;

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

/** Renders the last strike until it has died away, or for a minute, and saves it under the names of the body and its material. */
export async function saveStrike(): Promise<void> {
  const { point: [px, py, pz], impulse: [x, y, z], striker, ...object } = strikeToRender();
  const name = `${state.nameOf(state.model.value!.summary)}_${state.materialName.value}`;
  async function* trace(): AsyncGenerator<MessageInitShape<typeof RenderRequestSchema>> {
    yield { request: { case: 'settings' as const, value: {} } };
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
  saveAs(waveFile(blocks, rate, channels), `${name.replace(/[^\w.-]+/g, '_')}.wav`);
}

export function saveAs(file: Blob, name: string): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(file);
  link.download = name;
  link.click();
  // The browser reads the address after this function has ended.
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}
