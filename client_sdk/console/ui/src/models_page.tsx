// SPDX-License-Identifier: Apache-2.0
import { signal } from '@preact/signals';
import { useEffect, useRef } from 'preact/hooks';
import { JobKind, JobState, Phase } from './gen/carillon/v1/decomposition_pb';
import type { ModalModelSummary } from './gen/carillon/v1/modal_model_service_pb';
import { lowestHz, noteOf, fetchModel } from './modal_model';
import * as state from './state';
import { drawThumbnail } from './thumbnail';

const text = signal('');
const tag = signal('');
const pointed = signal(0);
/** Pictures and lowest notes by the model's name and revision. */
const pictures = signal<Map<string, { picture: string; note: string }>>(new Map());
let drawing = Promise.resolve();

const madeAt = (model: ModalModelSummary) => new Date(Number(model.createdUnixMs)).toISOString().slice(0, 16).replace('T', ' ');
const keyOf = (model: ModalModelSummary) => `${model.name}/${model.revision}`;

/** Draws one picture after the other, of those that have been looked at. */
function wantPicture(model: ModalModelSummary): void {
  const key = keyOf(model);
  if (pictures.value.has(key)) return;
  pictures.value = new Map(pictures.value).set(key, { picture: '', note: '' });
  drawing = drawing.then(async () => {
    const fetched = await fetchModel(state.services, model.name);
    const material = state.materials.value.find((entry) => entry.name === model.material?.preset)?.material;
    const hz = material && lowestHz(fetched, material, 1);
    pictures.value = new Map(pictures.value).set(key, { picture: drawThumbnail(fetched), note: hz ? `${hz.toFixed(0)} Hz ${noteOf(hz)}` : '' });
  }).catch(() => {});
}

function Row({ model, index, audition }: { model: ModalModelSummary; index: number; audition: (model: ModalModelSummary) => void }) {
  const row = useRef<HTMLTableRowElement>(null);
  useEffect(() => {
    const seen = new IntersectionObserver(([entry]) => { if (entry?.isIntersecting) wantPicture(model); });
    seen.observe(row.current!);
    return () => seen.disconnect();
  }, [keyOf(model)]);
  const drawn = pictures.value.get(keyOf(model));
  const change = (work: () => Promise<unknown>) => () => void state.attempt('', () => work().then(state.listModels));
  return <tr ref={row} id={`model-${index}`} aria-selected={pointed.value === index} onClick={() => { pointed.value = index; }}>
    <td>{drawn?.picture && <img src={drawn.picture} alt="" width="64" height="48" />}</td>
    <td><strong>{state.nameOf(model)}</strong><br /><small>{model.tags.join(' ')}</small></td>
    <td>{model.header?.modeCount}</td><td>{drawn?.note}</td><td>{model.material?.preset.replaceAll('_', ' ')}</td>
    <td>{(Number(model.storedBytes) / 1e6).toFixed(1)} MB</td><td>{madeAt(model)}</td>
    <td><button onClick={() => audition(model)}>Hear</button>{' '}
      <button onClick={() => { void state.openModel(model.name); location.hash = '#strike'; }}>Open</button>{' '}
      <button aria-pressed={model.pinned} onClick={change(() => state.services.models.updateModalModel({ name: model.name, pinned: !model.pinned }))}>
        {model.pinned ? 'Unpin' : 'Pin'}</button>{' '}
      <button disabled={model.pinned} onClick={() => { if (confirm(`Delete ${state.nameOf(model)} of ${madeAt(model)} UTC?`)) change(() => state.services.models.deleteModalModel({ name: model.name }))(); }}>Delete</button></td></tr>;
}

const SAYS: Partial<Record<JobState, string>> = { [JobState.QUEUED]: 'waits', [JobState.RUNNING]: 'runs', [JobState.SUCCEEDED]: 'done',
  [JobState.FAILED]: 'refused', [JobState.CANCELLED]: 'cancelled' };

function Jobs() {
  return <section><h2>Jobs</h2>
    {!state.jobs.value.size && <p class="hint">None waits or runs.</p>}
    {[...state.jobs.value.values()].reverse().map((job) => <div class="job">
      <strong>{job.label || job.name.slice(5, 17)}</strong> {job.kind === JobKind.TRANSFER ? 'radiation' : 'modes'} {SAYS[job.state]}
      {job.state === JobState.RUNNING && <> <progress aria-label={`Progress of ${job.label}`} value={job.progress?.fraction ?? 0} /> {job.progress?.phase ? Phase[job.progress.phase]!.toLowerCase() : ''}
        {job.progress?.remainingS ? ` ${Math.ceil(job.progress.remainingS)} s left` : ''}</>}
      {(job.state === JobState.RUNNING || job.state === JobState.QUEUED) &&
        <> <button onClick={() => void state.attempt('', () => state.services.jobs.cancelJob({ name: job.name }))}>Cancel</button></>}
      {job.state === JobState.FAILED && <p class="fault">{job.error?.message}{job.error?.remedies.map((remedy) => <><br />Try {remedy.option}: {remedy.effect}</>)}</p>}
    </div>)}</section>;
}

export function ModelsPage({ audition }: { audition: (model: ModalModelSummary) => void }) {
  useEffect(() => {
    void state.attempt('', state.listModels);
  }, []);
  const wanted = text.value.toLowerCase();
  const rows = state.listedModels.value.filter((model) => model.label.toLowerCase().includes(wanted) && (!tag.value || model.tags.includes(tag.value)));
  const tags = [...new Set(state.models.value.flatMap((model) => model.tags))].sort();
  const keys = (event: KeyboardEvent) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if ((event.target as HTMLElement).tagName === 'BUTTON') return;
    if (step) {
      pointed.value = Math.max(0, Math.min(rows.length - 1, pointed.value + step));
      document.getElementById(`model-${pointed.value}`)?.scrollIntoView({ block: 'nearest' });
    } else if (event.key === ' ') {
      if (rows[pointed.value]) audition(rows[pointed.value]!);
    } else return;
    event.preventDefault();
  };
  return <main>
    <div class="left"><section class="creation"><label>Label <input type="search" value={text.value} onInput={(event) => { text.value = event.currentTarget.value; pointed.value = 0; }} /></label>
      <label>Tag <select value={tag.value} onChange={(event) => { tag.value = event.currentTarget.value; }}><option value="">any</option>{tags.map((one) => <option>{one}</option>)}</select></label>
      <span class="hint">{rows.length} of {state.listedModels.value.length}. The space bar lets you hear the chosen row.</span></section>
      <div class="models" tabIndex={0} onKeyDown={keys} role="region" aria-label="Models. Up and Down choose, Space strikes.">
        <table><thead><tr><th>picture</th><th>label, tags</th><th>modes</th><th>lowest</th><th>material</th><th>size</th><th>made (UTC)</th><th>actions</th></tr></thead>
          <tbody>{rows.map((model, index) => <Row model={model} index={index} audition={audition} />)}</tbody></table></div></div>
    <div class="right"><Jobs />{state.fault.value && <p class="fault" role="alert">{state.fault.value.message}</p>}</div></main>;
}
