// SPDX-License-Identifier: Apache-2.0
// A trace as it is played: its bodies, a time line with their blows, and the blows about the playhead.
import type { ComponentChildren } from 'preact';
import { useEffect, useRef } from 'preact/hooks';
import { effect } from '@preact/signals';
import { newtonSeconds, strikerOf } from './blow_text';
import { colorOf, LiveView } from './live_view';
import type { SurfaceOf } from './live_view';
import * as trace from './trace_state';

const LEFT = 110, WAVE_HEIGHT = 60, ROW_HEIGHT = 22;
/** How long before the playhead a blow is still shown on its body, s. */
const RECENT_S = 0.15;
const STEP_S = 0.1;

function Bodies({ surfaceOf }: { surfaceOf: SurfaceOf }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const view = new LiveView(canvas.current!, surfaceOf);
    let shownS = 0;
    return effect(() => {
      const one = trace.trace.value, now = trace.timeS.value;
      if (!one) return;
      const since = now > shownS && now - shownS < 1 ? shownS : now - RECENT_S;
      shownS = now;
      void view.update(one.scene, trace.objects.value).then(() => {
        for (const blow of one.blows) if (blow.timeS > since && blow.timeS <= now) view.blow({ blow, seenMs: Date.now() });
      });
    });
  }, []);
  return <canvas ref={canvas} class="body scene" tabIndex={0} role="img" aria-label="The bodies of the trace at the playhead" />;
}

/** The loudness of the sound over the time, and under it a row for each body with its blows as dots. */
function drawLine(canvas: HTMLCanvasElement, one: trace.Trace, timeS: number): void {
  const width = canvas.clientWidth, height = WAVE_HEIGHT + ROW_HEIGHT * one.objects.length;
  canvas.style.height = `${height}px`;
  canvas.width = width * devicePixelRatio;
  canvas.height = height * devicePixelRatio;
  const pen = canvas.getContext('2d')!;
  pen.scale(devicePixelRatio, devicePixelRatio);
  const x = (time: number) => LEFT + (width - LEFT) * time / one.sound.duration;
  pen.fillStyle = '#3b7dd8';
  const columns = columnsOf(one, Math.max(1, width - LEFT));
  columns.forEach((share, column) => pen.fillRect(LEFT + column, WAVE_HEIGHT / 2 * (1 - share), 1, Math.max(WAVE_HEIGHT * share, 0.5)));
  pen.font = '12px system-ui';
  const ink = getComputedStyle(canvas).color;
  one.objects.forEach(({ handle }, row) => {
    const y = WAVE_HEIGHT + ROW_HEIGHT * (row + 0.5);
    pen.fillStyle = ink;
    pen.fillText(one.labels.get(handle)!.slice(0, 16), 4, y + 4);
    pen.fillStyle = colorOf(handle);
    for (const blow of one.blows) {
      if (blow.object !== handle) continue;
      pen.beginPath();
      pen.arc(x(blow.timeS), y, Math.min(9, 1.5 + 3 * Math.cbrt(newtonSeconds(blow) / 0.01)), 0, 2 * Math.PI);
      pen.fill();
    }
  });
  pen.fillStyle = '#d43d00';
  pen.fillRect(x(timeS), 0, 1.5, height);
}

let drawn: { trace: trace.Trace; columns: Float32Array } | undefined;

/** The largest sample in each column, as a share of the largest of all. */
function columnsOf(one: trace.Trace, count: number): Float32Array {
  if (drawn?.trace === one && drawn.columns.length === count) return drawn.columns;
  const columns = new Float32Array(count), samples = one.sound.getChannelData(0);
  for (let i = 0; i < samples.length; i += 1) {
    const column = Math.floor(i * count / samples.length);
    columns[column] = Math.max(columns[column]!, Math.abs(samples[i]!));
  }
  const largest = Math.max(1e-9, ...columns);
  drawn = { trace: one, columns: columns.map((sample) => sample / largest) };
  return drawn.columns;
}

function Line() {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const draw = () => { if (trace.trace.value) drawLine(canvas.current!, trace.trace.value, trace.timeS.value); };
    new ResizeObserver(draw).observe(canvas.current!);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', draw);
    return effect(draw);
  }, []);
  const durationS = trace.trace.value?.sound.duration ?? 0;
  const keys = (event: KeyboardEvent) => {
    const step = { ArrowLeft: -STEP_S, ArrowRight: STEP_S }[event.key];
    if (!trace.trace.value || (!step && event.key !== ' ')) return;
    if (step) trace.seek(trace.timeS.value + step);
    else trace.toggle();
    event.preventDefault();
  };
  const point = (event: MouseEvent) => {
    if (durationS) trace.seek((event.offsetX - LEFT) / (canvas.current!.clientWidth - LEFT) * durationS);
  };
  return <canvas ref={canvas} class="line" tabIndex={0} role="slider" aria-label="Playhead, s. Left and Right move it, Space plays."
    aria-valuemin={0} aria-valuemax={durationS} aria-valuenow={Number(trace.timeS.value.toFixed(1))} onKeyDown={keys} onClick={point} />;
}

function Blows() {
  const one = trace.trace.value;
  const near = one?.blows.map((blow) => ({ blow, distance: Math.abs(blow.timeS - trace.timeS.value) }))
    .sort((a, b) => a.distance - b.distance).slice(0, 12).map(({ blow }) => blow).sort((a, b) => a.timeS - b.timeS) ?? [];
  const name = (handle: number) => one!.labels.get(handle) ?? `body ${handle}`;
  return <section class="blows"><h2>Blows about the playhead</h2><table><thead><tr><th>at s</th><th>body</th><th>by</th><th>N s</th><th>ms</th></tr></thead>
    <tbody>{near.map((blow) => <tr><td><button class="inline" onClick={() => trace.seek(blow.timeS)}>{blow.timeS.toFixed(3)}</button></td>
      <td><i class="dot" style={{ background: colorOf(blow.object) }} /> {name(blow.object)}</td><td>{strikerOf(blow, name)}</td>
      <td>{newtonSeconds(blow).toPrecision(2)}</td><td>{(1000 * blow.durationS).toFixed(2)}</td></tr>)}</tbody></table></section>;
}

function Summary() {
  const one = trace.trace.value;
  if (!one) return <p class="hint">A simulator writes a trace, or <code>carillon scene record</code> records one.</p>;
  const { acceptedCount, rejectedCount, lastRejection, peakPa, integratedLufs, warnings } = one.summary;
  return <section><h2>Sound of {one.name}</h2>
    <p class="hint">{one.sound.duration.toFixed(1)} s, {one.objects.length} bodies, {String(acceptedCount)} impulses, {String(rejectedCount)} rejected,
      peak {peakPa.toPrecision(2)} Pa{integratedLufs === undefined ? '' : `, ${integratedLufs.toFixed(1)} LUFS`.replace('-', '−')}. It is played with its peak at 0.9 of full scale.</p>
    {lastRejection && <p class="fault">{lastRejection.message}</p>}
    {warnings.map((warning) => <p class="warning"><strong>{warning.id}</strong> {warning.text}</p>)}</section>;
}

/** `children` are further controls, and what the page says. */
export function TraceView({ surfaceOf, children }: { surfaceOf: SurfaceOf; children?: ComponentChildren }) {
  useEffect(() => trace.stop, []);
  const ready = trace.trace.value !== undefined;
  return <main>
    <div class="left"><section class="creation">
      <button disabled={!ready} onClick={trace.toggle}>{trace.playing.value ? 'Pause' : 'Play'}</button>
      <label class="tick"><input type="checkbox" checked={trace.loop.value} onChange={(event) => trace.setLoop(event.currentTarget.checked)} /> loop</label>
      {children}</section>
      <Bodies surfaceOf={surfaceOf} /><Line /></div>
    <div class="right" tabIndex={0} role="region" aria-label="The trace and its blows"><Summary /><Blows /></div></main>;
}
