// SPDX-License-Identifier: Apache-2.0
import { useEffect, useRef, useState } from 'preact/hooks';
import { effect } from '@preact/signals';
import { BodyView } from './body_view';
import type { Strike } from './body_view';
import { Phase } from './gen/carillon/v1/decomposition_pb';
import { placesIn, previewOf } from './mesh_preview';
import { lowestHz, noteOf } from './modal_model';
import type { SoundingMode } from './modal_model';
import { player, playerChanged, sound, soundByGesture, soundReady, sounding } from './sounding';
import { drawSpectrum, modeAt, Spectrogram } from './spectrum';
import * as state from './state';
import { saveStrike } from './wave_file';

const STRIKERS = ['steel', 'wood', 'rubber', 'felt', 'fingertip'];
const UNITS: [string, number][] = [['m', 1], ['cm', 0.01], ['mm', 0.001], ['inch', 0.0254]];
/** A mode so far below the loudest is not heard at a point. */
const SILENT_DB = -40;
export let view: BodyView | undefined;

function Body() {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    view = new BodyView(canvas.current!, (at) => void strikeAndShow(at));
    const ends = [effect(() => { if (state.model.value) view!.show(state.model.value); }), effect(showUpload)];
    return () => ends.forEach((end) => end());
  }, []);
  return <canvas ref={canvas} class="body" tabIndex={0} onKeyDown={keyOnBody} role="application"
    aria-label="The body. Arrows turn it, Shift with arrows moves the point, Space strikes." />;
}

/** Shows the file that is being made a model, until there is one, and where a refusal says it is wrong. */
function showUpload(): void {
  const upload = state.upload.value;
  const places = placesIn(state.fault.value?.message ?? '');
  if (!upload || state.job.value?.coarseReady) return;
  void previewOf(upload.file, upload.unit).then((surface) => {
    if (surface && state.upload.value?.file === upload.file && !state.coarse.value) view?.preview(surface, places);
  });
}

async function strikeAndShow(at: Strike): Promise<void> {
  if (!sounding.value) soundByGesture();
  await soundReady();
  state.sendStrike(at);
  state.strike.value = at;
  state.chosenMode.value = undefined;
  const row = await state.readRow(at);
  if (row) await view?.showStrike(at, row, state.modes.value);
}

export function strikeAgain(): void {
  if (state.strike.value) void strikeAndShow(state.strike.value);
}

/** Opens a model and strikes it where it sticks out most, which rings loudly for most bodies. */
export async function audition({ name }: { name: string }): Promise<void> {
  if (state.model.value?.name !== name) await state.openModel(name);
  const at = state.strike.value ?? view?.outermost();
  if (at) await strikeAndShow(at);
}

/** The place of the keyboard's point on the canvas, -1 to 1 each way. */
const cursor = { x: 0, y: 0 };

function keyOnBody(event: KeyboardEvent) {
  const step = ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] } as Record<string, [number, number]>)[event.key];
  if (step && event.shiftKey) {
    const next = { x: cursor.x + 0.02 * step[0], y: cursor.y + 0.02 * step[1] };
    const at = view?.pick(next.x, next.y);
    if (at) {
      Object.assign(cursor, next);
      state.strike.value = at;
      view?.mark(at);
      void state.readRow(at);
    }
  } else if (step) view?.turn(0.1 * step[0], 0.1 * step[1]);
  else if (event.key === ' ') {
    const at = view?.pick(cursor.x, cursor.y) ?? state.strike.value;
    if (at) void strikeAndShow(at);
  } else return;
  event.preventDefault();
}

function Spectrum() {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => effect(() => drawSpectrum(canvas.current!, state.modes.value, state.keptModes.value, state.chosenMode.value)), []);
  const choose = (event: MouseEvent) => {
    const mode = modeAt(canvas.current!, state.modes.value, event.offsetX);
    if (mode) chooseMode(mode.index);
  };
  return <figure><figcaption>Modes at this point: dB above 20 µPa in air at 1 m, before the hammer softens them; the error lies
    to the left{state.kept.value ? '; A in orange' : ''}</figcaption>
    <canvas ref={canvas} class="spectrum" onClick={choose} aria-hidden="true" /></figure>;
}

function chooseMode(index: number) {
  state.chosenMode.value = index;
  const mode = state.modes.value.find((one) => one.index === index);
  if (mode) void view?.showMode(mode);
}

/** How far a mode is below the loudest at the point, dB. */
function levelHere(mode: SoundingMode, loudestPa: number): number {
  return 20 * Math.log10(mode.levelPa / loudestPa);
}

function Modes() {
  const keys = (event: KeyboardEvent) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const next = Math.max(0, Math.min(state.modes.value.length - 1, (state.chosenMode.value ?? -step) + step));
    chooseMode(next);
    document.getElementById(`mode-${next}`)?.scrollIntoView({ block: 'nearest' });
  };
  const chosen = state.chosenMode.value;
  const loudest = Math.max(...state.modes.value.map((mode) => mode.levelPa));
  const here = (mode: SoundingMode) => (loudest > 0 ? levelHere(mode, loudest) : undefined);
  const text = (db: number | undefined) => (db === undefined ? '' : db < SILENT_DB ? 'silent' : `${db.toFixed(0)} dB`.replace('-', '−'));
  return <section class="modes"><h2 id="modes">Modes {state.coarse.value ? '(coarse, finer ones follow)' : ''}</h2>
    <p class="columns" aria-hidden="true"><span>#</span><span>Hz</span><span>note</span><span>−%</span><span>T60 s</span><span>here</span></p>
    <ul role="listbox" aria-labelledby="modes" tabIndex={0} onKeyDown={keys}
      aria-activedescendant={chosen === undefined ? undefined : `mode-${chosen}`}>
      {state.modes.value.map((mode) => <li role="option" id={`mode-${mode.index}`} aria-selected={mode.index === chosen}
        class={(here(mode) ?? 0) < SILENT_DB ? 'silent' : ''} onClick={() => chooseMode(mode.index)}>
        <span>{mode.index + 1}</span><span>{mode.frequencyHz.toFixed(1)}</span><span>{noteOf(mode.frequencyHz)}</span>
        <span>{mode.error > 0.3 ? '> 30' : (100 * mode.error).toFixed(2)}</span><span>{mode.t60S.toPrecision(2)}</span>
        <span>{text(here(mode))}</span></li>)}
    </ul></section>;
}

function Slider({ label, value, range, set }: { label: string; value: number; range: [number, number]; set: (value: number) => void }) {
  return <label>{label} <input type="range" min={range[0]} max={range[1]} step="0.01" value={Math.log10(value)}
    onInput={(event) => set(10 ** Number(event.currentTarget.value))}
    onChange={() => void state.updateObject().then(strikeAgain)} /></label>;
}

function MaterialChoice() {
  const model = state.model.value;
  const note = (name: string) => {
    const material = state.materials.value.find((entry) => entry.name === name)?.material;
    return model && material ? ` · ${noteOf(lowestHz(model, material, state.size.value))}` : '';
  };
  const choose = (name: string) => {
    state.materialName.value = name;
    state.factors.value = state.UNCHANGED;
    void state.updateObject().then(strikeAgain);
  };
  const factor = (name: keyof state.Factors, label: string) => <Slider label={`${label} × ${state.factors.value[name].toFixed(2)}`}
    value={state.factors.value[name]} range={[-1, 1]}
    set={(value) => { state.factors.value = { ...state.factors.value, [name]: value }; void state.updateObject(); }} />;
  return <>
    <label>Material, with the lowest note that this body has of it <select value={state.materialName.value}
      onChange={(event) => choose(event.currentTarget.value)}>
      {[...state.materials.value].sort((a, b) => a.name.localeCompare(b.name)).map(({ name }) =>
        <option value={name}>{name.replaceAll('_', ' ')}{note(name)}</option>)}</select></label>
    {state.ratioError.value > 0.001 && <p class="hint">The body was computed for a material with another Poisson’s ratio; of this one,
      modes lie up to {(100 * state.ratioError.value).toFixed(1)} % elsewhere.</p>}
    <details><summary>Its figures</summary>
      {factor('young', 'Young’s modulus')}{factor('density', 'Density')}{factor('damping', 'Damping')}</details>
  </>;
}

function Controls() {
  return <section class="controls"><h2>Strike</h2><MaterialChoice />
    <Slider label={`Size × ${state.size.value.toFixed(2)}`} value={state.size.value} range={[-0.7, 0.7]}
      set={(value) => { state.size.value = value; void state.updateObject(); }} />
    <label>Hammer <select value={state.striker.value}
      onChange={(event) => { state.striker.value = event.currentTarget.value; strikeAgain(); }}>
      {STRIKERS.map((name) => <option>{name}</option>)}</select></label>
    <Slider label={`Impulse ${state.impulse.value.toPrecision(2)} N s`} value={state.impulse.value} range={[-4, 1]}
      set={(value) => { state.impulse.value = value; }} />
    <p class="buttons">
      <button disabled={!state.strike.value} onClick={strikeAgain}>Strike again</button>
      <button disabled={!state.strike.value} onClick={() => void state.attempt('rendering', () => saveStrike())}>Save WAV</button>
      <button disabled={!state.model.value} onClick={state.keep}>Keep as A</button>
      <button disabled={!state.kept.value} onClick={() => void state.swap().then(() => { if (state.strike.value) strikeAgain(); })}>Swap with A</button>
    </p></section>;
}

function Creation() {
  const [unit, setUnit] = useState(1);
  const [repair, setRepair] = useState(false);
  const choose = (files?: FileList | null) => {
    if (files?.[0]) void state.createModel({ file: files[0], unit, repair });
  };
  useEffect(() => {
    const over = (event: DragEvent) => event.preventDefault();
    const drop = (event: DragEvent) => { event.preventDefault(); choose(event.dataTransfer?.files); };
    addEventListener('dragover', over);
    addEventListener('drop', drop);
    return () => { removeEventListener('dragover', over); removeEventListener('drop', drop); };
  }, [unit, repair]);
  const listed = state.models.value.some((one) => one.name === state.model.value?.name);
  return <section class="creation">
    <label>Body <select value={state.model.value?.name ?? ''} onChange={(event) => { state.upload.value = undefined; void state.openModel(event.currentTarget.value); }}>
      {!listed && <option value={state.model.value?.name ?? ''}>{state.model.value?.summary.label ?? 'none yet'}</option>}
      {state.models.value.map(({ name, label }) => <option value={name}>{label || name.slice(12, 24)}</option>)}</select></label>
    <label>New: drop a mesh file anywhere, or <input type="file" onChange={(event) => choose(event.currentTarget.files)} /></label>
    <label>its unit <select value={unit} onChange={(event) => setUnit(Number(event.currentTarget.value))}>
      {UNITS.map(([name, metres]) => <option value={metres}>{name}</option>)}</select></label>
    <label class="tick"><input type="checkbox" checked={repair} onChange={(event) => setRepair(event.currentTarget.checked)} /> repair</label>
  </section>;
}

/** A remedy as a button, where the page knows the field. */
function Remedies() {
  const upload = state.upload.value;
  const known = upload ? state.fault.value?.remedies?.filter((remedy) => remedy.field === 'settings.mesh.repair') ?? [] : [];
  return <>{known.map((remedy) => <button title={remedy.effect} onClick={() => void state.createModel({ ...upload!, repair: true })}>Repair it</button>)}</>;
}

function News() {
  const job = state.job.value;
  const progress = job?.progress;
  const place = state.strike.value?.point.map((metres) => (1000 * metres * state.size.value).toFixed(1)).join(', ');
  return <div class="news" role="status">
    {job && <p><progress aria-label="Progress" value={progress?.fraction ?? 0} /> {progress?.phase ? Phase[progress.phase]!.toLowerCase() : 'waiting'}
      {progress?.remainingS ? `, ${Math.ceil(progress.remainingS)} s left` : ''}
      {progress?.convergedModeCount ? `, ${progress.convergedModeCount} modes` : ''}{state.coarse.value ? '; strike the coarse body now' : ''}
      {' '}<button onClick={() => void state.services.jobs.cancelJob({ name: job.name })}>Cancel</button></p>}
    {!job && state.busy.value && <p>{state.busy.value} …</p>}
    {state.fault.value && <p class="fault" role="alert">{state.fault.value.message} <Remedies /></p>}
    {!state.reached.value && <p class="fault">The console is not reached; it is tried again.</p>}
    {!job && !state.busy.value && !state.fault.value && <p>{place ? `Point ${place} mm` : state.model.value ? 'Click a point of the body to hear it.' : 'Drop a mesh file anywhere.'}</p>}
  </div>;
}

/** `chosen` gets the time, s of the mixer, of a place that is clicked. */
export function SpectrogramView({ chosen }: { chosen?: (timeS: number) => void }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const drawn = useRef<Spectrogram>();
  playerChanged.value;
  useEffect(() => {
    if (!player.analyser || drawn.current?.analyser === player.analyser) return;
    drawn.current?.end();
    drawn.current = new Spectrogram(canvas.current!, player.analyser, () => player.playedS());
  });
  useEffect(() => () => drawn.current?.end(), []);
  const choose = (event: MouseEvent) => {
    const time = drawn.current?.timeAt(event.offsetX / canvas.current!.clientWidth);
    if (time !== undefined) chosen?.(time);
  };
  return <figure><figcaption>What is heard here, to 16 kHz{chosen && '; click a sound to see the blow that made it'}{sounding.value ? '' : ': nothing, '}
    {!sounding.value && <button class="inline sound" onClick={() => sound('')}>hear the daemon in this browser</button>}</figcaption>
    <canvas ref={canvas} class="spectrogram" onClick={choose} aria-hidden="true" /></figure>;
}

export function StrikePage() {
  return <main>
    <div class="left"><Creation /><Body /><News /><Spectrum /><SpectrogramView /></div>
    <div class="right"><Controls /><Modes /></div></main>;
}
