// SPDX-License-Identifier: Apache-2.0
// The page that `carillon render --html` writes: a trace, its sound and its bodies in one file, which needs no server.
import { render } from 'preact';
import { fromBinary } from '@bufbuild/protobuf';
import { RenderedBlowsSchema, RenderSummarySchema } from './gen/carillon/v1/audio_service_pb';
import * as trace from './trace_state';
import { TraceView } from './trace_view';

/** What the command puts into the page, in base64. */
interface Contents {
  name: string;
  contacts: string;
  wave: string;
  blows: string;
  summary: string;
  /** Of each model: three float32 a vertex, m, and three uint32 a triangle. */
  surfaces: Record<string, { vertices: string; triangles: string }>;
}

const bytesOf = (base64: string) => Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
const { contacts, wave, blows, summary, surfaces, ...more } = JSON.parse(document.getElementById('trace')!.textContent!) as Contents;
const name = new TextDecoder().decode(bytesOf(more.name));

const surfaceOf = (model: string) => Promise.resolve({ vertices: new Float32Array(bytesOf(surfaces[model]!.vertices).buffer),
  triangles: new Uint32Array(bytesOf(surfaces[model]!.triangles).buffer) });

document.title = name;
render(<><header><h1>{name}</h1></header><TraceView surfaceOf={surfaceOf} /></>, document.body);
const file = new Blob([bytesOf(wave)], { type: 'audio/wav' });
trace.trace.value = { name, wave: file, sound: await trace.soundOf(file), blows: fromBinary(RenderedBlowsSchema, bytesOf(blows)).blows,
  summary: fromBinary(RenderSummarySchema, bytesOf(summary)), ...trace.motionOf(trace.recordsIn(bytesOf(contacts))) };
Object.assign(globalThis, { carillonTrace: trace });
