// SPDX-License-Identifier: Apache-2.0
// A trace from a file, which the daemon renders.
import { useEffect } from 'preact/hooks';
import { RenderSummarySchema } from './gen/carillon/v1/audio_service_pb';
import type { Blow } from './gen/carillon/v1/audio_service_pb';
import { create } from '@bufbuild/protobuf';
import { fetchSurface } from './modal_model';
import * as state from './state';
import * as trace from './trace_state';
import { TraceView } from './trace_view';
import { saveAs, waveFile } from './wave_file';

/** Reads a .contacts file, and has it rendered. */
export async function open(file: File): Promise<void> {
  await state.attempt(`rendering ${file.name}`, async () => {
    trace.stop();
    const records = trace.recordsIn(new Uint8Array(await file.arrayBuffer()));
    const motion = trace.motionOf(records);
    const channelCount = motion.scene.hearing?.panning || motion.scene.hearing?.binaural ? 2 : 1;
    async function* requests() {
      yield { request: { case: 'settings' as const, value: { tellBlows: true, channelCount } } };
      for (const record of records) yield { request: { case: 'record' as const, value: record } };
    }
    const blocks: Uint8Array[] = [], blows: Blow[] = [];
    let rate = 48000, summary = create(RenderSummarySchema);
    for await (const { response } of state.services.audio.render(requests())) {
      if (response.case === 'format') rate = response.value.sampleRateHz;
      else if (response.case === 'block') blocks.push(response.value.samples);
      else if (response.case === 'blows') blows.push(...response.value.blows);
      else if (response.case === 'summary') summary = response.value;
    }
    const wave = waveFile(blocks, rate, channelCount);
    trace.timeS.value = 0;
    trace.trace.value = { name: file.name, wave, sound: await trace.soundOf(wave), blows, summary, ...motion };
  });
}

const save = () => saveAs(trace.trace.value!.wave, `${trace.trace.value!.name.replace(/\.[^.]*$/, '')}.wav`);

export function TracePage() {
  useEffect(() => { state.fault.value = undefined; }, []);
  return <TraceView surfaceOf={(name) => fetchSurface(state.services, name)}>
    <button disabled={!trace.trace.value} onClick={save}>Save WAV</button>
    <label>Contact trace (.contacts) <input type="file" accept=".contacts"
      onChange={(event) => { const [file] = event.currentTarget.files ?? []; if (file) void open(file); }} /></label>
    <span role="status">{state.busy.value && `${state.busy.value} …`}</span>
    {state.fault.value && <span class="fault" role="alert">{state.fault.value.message}</span>}</TraceView>;
}
