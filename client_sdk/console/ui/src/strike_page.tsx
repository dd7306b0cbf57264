// SPDX-License-Identifier: Apache-2.0
import { useEffect, useRef, useState } from 'preact/hooks';
import { effect } from '@preact/signals';
import { BodyView } from './body_view';
import type { Strike } from './body_view';
import { JobState, Phase } from './gen/carillon/v1/decomposition_pb';
import { isMaterialFile } from './material_file';
import { inUnitOf, placesIn } from './mesh_preview';
import { hzOf, lowestHz, noteOf } from './modal_model';
import type { SoundingMode } from './modal_model';
import { player, playerChanged, sound, soundByGesture, soundReady, sounding } from './sounding';
import { drawSpectrum, modeAt, Spectrogram } from './spectrum';
import * as state from './state';
import { saveStrike } from './wave_file';

const STRIKERS = ['steel', 'wood', 'rubber', 'felt', 'fingertip'];
const UNITS: [string, number][] = [['not said', 0], ['m', 1], ['cm', 0.01], ['mm', 0.001], ['inch', 0.0254]];
/** What moves less than this share of the body's root mean square is a node. */
const NODE = 0.03;
/** The keys of a slider strike once, after the last of them. */
const LET_GO_MS = 300;
export let view: BodyView | undefined;

function Body() {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    view = new BodyView(canvas.current!, (at) => void strikeAndShow(at));
    const ends = [effect(() => { if (state.model.value) view!.show(state.model.value); }), effect(showUpload)];
    return () => ends.forEach((end) => end());
  }, []);
  return <canvas ref={canvas} class="body" tabIndex={0} onKeyDown={keyOnBody} role="application"
    aria-label="The body. Arrows turn it, Shift with arrows moves the point, Control makes the steps finer, Space strikes." />;
}

/** Shows the file that is being made a model, until there is one, and where a refusal says it is wrong. */
function showUpload(): void {
  const upload = state.upload.value;
  if (!state.model.value) view?.preview(upload?.preview?.surface, upload?.unit || 1, placesIn(upload?.refusal?.message ?? ''));
}

async function strikeAndShow(at: Strike): Promise<void> {
  if (!sounding.value) soundByGesture();
  await soundReady();
  state.sendStrike(at);
  // What is drawn anew waits until the strike is on its way.
  await new Promise((resolve) => setTimeout(resolve));
  state.strike.value = at;
  view?.mark(at);
  const row = await state.readRow(at);
  // A mode that was chosen stays in sight, so that its nodal lines can be struck.
  if (row && state.chosenMode.value === undefined) await view?.showStrike(at, row, state.modes.value).catch(state.showFault);
}

export function strikeAgain(): void {
  if (state.strike.value) void strikeAndShow(state.strike.value);
}

/** Opens a model and strikes it where it sticks out most, which rings loudly for most bodies. */
export async function audition({ name }: { name: string }): Promise<void> {
  if (state.model.value?.name !== name) await state.openModel(name);
  await strikeOutermost(state.strike.value);
}

export async function strikeOutermost(at = view?.outermost()): Promise<void> {
  if (at) await strikeAndShow(at);
}

function keyOnBody(event: KeyboardEvent) {
  const step = ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] } as Record<string, [number, number]>)[event.key];
  const share = event.ctrlKey ? 0.1 : 1;
  if (step && event.shiftKey) {
    const from = state.strike.value ? view!.project(state.strike.value.point) : { x: 0, y: 0 };
    const at = view?.pick(from.x + 0.02 * share * step[0], from.y + 0.02 * share * step[1]);
    if (at) {
      state.strike.value = at;
      view?.mark(at);
      void state.readRow(at);
    }
  } else if (step) view?.turn(0.1 * share * step[0], 0.1 * share * step[1]);
  else if (event.key === ' ') {
    const at = state.strike.value ?? view?.pick(0, 0);
    if (at) void strikeAndShow(at);
  } else return;
  event.preventDefault();
}

function Spectrum() {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const draw = () => drawSpectrum(canvas.current!, state.modes.value, state.keptModes.value, state.chosenMode.value);
    new ResizeObserver(draw).observe(canvas.current!);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', draw);
    return effect(draw);
  }, []);
  const choose = (event: MouseEvent) => {
    const mode = modeAt(canvas.current!, state.modes.value, event.offsetX);
    if (mode) chooseMode(mode.index);
  };
  return <figure><figcaption>Modes at this point: dB above 20 µPa in air at 1 m, before the hammer softens them; a line to the
    left is how far a mode may lie below{state.radiation.value === 'included' ? '' : '; by a rule of thumb, without radiation, which may be 30 dB off'}{state.kept.value
      ? `; in orange A: ${state.kept.value.materialName.replaceAll('_', ' ')}, size × ${state.kept.value.size.toFixed(2)}` : ''}</figcaption>
    <canvas ref={canvas} class="spectrum" onClick={choose} aria-hidden="true" /></figure>;
}

function chooseMode(index: number) {
  if (state.chosenMode.value === index) {
    state.chosenMode.value = undefined;
    if (state.strike.value && state.row.value) void view?.showStrike(state.strike.value, state.row.value, state.modes.value).catch(state.showFault);
    return;
  }
  state.chosenMode.value = index;
  const mode = state.modes.value.find((one) => one.index === index);
  if (mode) void view?.showMode(mode).catch(state.showFault);
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
    if (next !== state.chosenMode.value) chooseMode(next);
    document.getElementById(`mode-${next}`)?.scrollIntoView({ block: 'nearest' });
  };
  const chosen = state.chosenMode.value;
  const loudest = Math.max(...state.modes.value.map((mode) => mode.levelPa));
  const here = (mode: SoundingMode) => {
    if (!state.row.value) return '';
    if (mode.moves < NODE) return 'silent';
    if (mode.movesAlong < NODE) return 'across';
    const db = levelHere(mode, loudest);
    return db < -99 ? '< −99' : `${db.toFixed(0)} dB`.replace('-', '−');
  };
  /** What is said of the modes that the column calls `word`, with their numbers. */
  const missing = (word: string, says: string) => {
    const numbers = state.modes.value.filter((mode) => here(mode) === word).map((mode) => mode.index + 1);
    return numbers.length ? `${says}: ${numbers.slice(0, 8).join(', ')}${numbers.length > 8 ? ` and ${numbers.length - 8} more` : ''}. ` : '';
  };
  const missingHere = missing('silent', 'Missing at this point, where they have a node') + missing('across', 'Moving across the blow');
  const seconds = (s: number) => (s < 10 ? s.toPrecision(2) : s.toFixed(0));
  return <section class="modes"><h2 id="modes">Modes {state.coarse.value ? (state.job.value ? '(coarse, finer ones follow)' : '(coarse)') : ''}</h2><Radiation />
    {state.row.value && <p class="hint">{missingHere || 'No mode is missing at this point.'}</p>}
    <p class="columns" aria-hidden="true"><span>#</span><span>Hz</span><span>note</span><span title="how far the true frequency may lie below">low %</span><span>T60 s</span>
      <span title="below the loudest; silent: a node; across: the point moves across the blow">here</span></p>
    <ul role="listbox" aria-labelledby="modes" tabIndex={0} onKeyDown={keys}
      aria-activedescendant={chosen === undefined ? undefined : `mode-${chosen}`}>
      {state.modes.value.map((mode) => <li role="option" id={`mode-${mode.index}`} aria-selected={mode.index === chosen}
        class={/[a-z]$/.test(here(mode)) ? 'silent' : ''} onClick={() => chooseMode(mode.index)}>
        <span>{mode.index + 1}</span><span>{mode.frequencyHz.toFixed(1)}</span><span>{noteOf(mode.frequencyHz)}</span>
        <span>{mode.error > 0.3 ? '> 30' : (100 * mode.error).toFixed(2)}</span><span>{seconds(mode.t60S)}</span>
        <span>{here(mode)}</span></li>)}
    </ul></section>;
}

/** Whether the table has the radiation into air, which comes some time after a model. */
function Radiation() {
  const radiation = state.radiation.value;
  if (!state.model.value) return null;
  if (radiation === 'included') return <p class="hint" role="status">Levels and T60 with the radiation into air.</p>;
  return <p class="hint" role="status">T60 by the material alone, levels by a rule of thumb: the radiation into air {radiation === 'absent'
    ? <>is not known for this material. <button class="inline" onClick={() => void state.computeRadiation()}>Compute it</button></>
    : `is being computed${radiation.progress?.remainingS ? `, ${Math.ceil(radiation.progress.remainingS)} s left` : ''}.`}</p>;
}

let letGo = 0;
function updateAndStrike(): void {
  clearTimeout(letGo);
  letGo = setTimeout(() => void state.updateObject().then(strikeAgain), LET_GO_MS);
}

function Slider({ label, value, range, set }: { label: string; value: number; range: [number, number]; set: (value: number) => void }) {
  return <label>{label} <input type="range" min={range[0]} max={range[1]} step="0.01" value={Math.log10(value)}
    onInput={(event) => set(10 ** Number(event.currentTarget.value))}
    onChange={updateAndStrike} /></label>;
}

function MaterialChoice() {
  const model = state.model.value;
  const note = (name: string) => {
    const material = state.materials.value.find((entry) => entry.name === name)?.material;
    return model && material ? ` · ${noteOf(lowestHz(model, material, state.size.value))}` : '';
  };
  const [byNote, setByNote] = useState(false);
  const hz = (entry: (typeof state.materials.value)[number]) => (byNote && model && entry.material ? lowestHz(model, entry.material, 1) : 0);
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
      {[...state.materials.value].sort((a, b) => hz(a) - hz(b) || a.name.localeCompare(b.name)).map(({ name }) =>
        <option value={name}>{name.replaceAll('_', ' ')}{note(name)}</option>)}</select></label>
    <label class="tick"><input type="checkbox" checked={byNote} onChange={(event) => setByNote(event.currentTarget.checked)} /> listed by note</label>
    {state.ratioError.value > 0.001 && <p class="hint">The body was computed for a material with another Poisson’s ratio; of this one,
      modes lie up to {(100 * state.ratioError.value).toFixed(1)} % elsewhere.</p>}
    <details><summary>Its figures</summary>
      {factor('young', 'Young’s modulus')}{factor('density', 'Density')}{factor('damping', 'Damping')}</details>
  </>;
}

/** The size by a number, or by the note that the lowest mode is to have. */
function ExactSize() {
  /** Says what is wrong beside the field; it stays as it was typed. */
  const refuse = (field: HTMLInputElement, says: string) => {
    field.setCustomValidity(says);
    if (says) field.reportValidity();
  };
  const set = (size: number) => {
    state.size.value = size;
    updateAndStrike();
  };
  const exactly = (field: HTMLInputElement) => {
    const size = Number(field.value);
    refuse(field, size > 0 ? '' : 'A size is above 0.');
    if (size > 0) set(size);
  };
  const tune = (field: HTMLInputElement) => {
    const hz = hzOf(field.value), { model, material } = state;
    refuse(field, hz || !field.value ? '' : 'Give a note, such as A4, Bb4 or A4 +20 (cents), or a frequency in Hz.');
    if (hz && model.value && material.value) set(lowestHz(model.value, material.value, 1) / hz);
  };
  return <p class="exact"><label>Exactly <input type="number" step="any" value={Number(state.size.value.toFixed(5))}
    onInput={(event) => event.currentTarget.setCustomValidity('')} onChange={(event) => exactly(event.currentTarget)} /></label>
    <label>Tune mode 1 to <input placeholder="A4 or 440" onInput={(event) => event.currentTarget.setCustomValidity('')} onChange={(event) => tune(event.currentTarget)} /></label></p>;
}

function Controls() {
  return <section class="controls"><h2>Strike</h2><MaterialChoice />
    <Slider label={`Size × ${state.size.value.toFixed(2)}`} value={state.size.value} range={[-0.7, 0.7]}
      set={(value) => { state.size.value = value; void state.updateObject(); }} />
    <ExactSize />
    <label>Hammer <select value={state.striker.value}
      onChange={(event) => { state.striker.value = event.currentTarget.value; strikeAgain(); }}>
      {STRIKERS.map((name) => <option>{name}</option>)}</select></label>
    <Slider label={`Impulse ${state.impulse.value.toPrecision(2)} N s`} value={state.impulse.value} range={[-4, 1]}
      set={(value) => { state.impulse.value = value; }} />
    <p class="buttons">
      <button disabled={!state.strike.value} onClick={strikeAgain}>Strike again</button>
      <button disabled={!state.strike.value} onClick={() => void state.attempt('rendering', () => saveStrike())}>Save WAV</button>
      <button disabled={!state.model.value} onClick={state.keep}>Keep as A</button>
      <button disabled={!state.kept.value} title="What you hear now becomes A, and A what you hear" onClick={() => void state.swap().then(() => { if (state.strike.value) strikeAgain(); })}>Swap with A</button>
    </p></section>;
}

function Creation() {
  const unit = state.unit.value;
  const [repair, setRepair] = useState(false);
  const choose = (files?: FileList | null) => {
    if (!files?.[0]) return;
    if (isMaterialFile(files[0])) void state.takeMaterial(files[0]).then(strikeAgain);
    else void state.createModel({ file: files[0], unit, repair });
  };
  useEffect(() => {
    const over = (event: DragEvent) => event.preventDefault();
    const drop = (event: DragEvent) => { event.preventDefault(); choose(event.dataTransfer?.files); };
    addEventListener('dragover', over);
    addEventListener('drop', drop);
    return () => { removeEventListener('dragover', over); removeEventListener('drop', drop); };
  }, [unit, repair]);
  const open = state.model.value, models = state.listedModels.value;
  const listed = models.some((one) => one.name === open?.name);
  /** What tells a model from others of its name. */
  const made = (one: (typeof models)[number]) => (models.some((other) => other !== one && other.label === one.label)
    ? `, ${new Date(Number(one.createdUnixMs)).toLocaleString()}` : '');
  return <section class="creation">
    <label>Body <select value={open?.name ?? ''} onChange={(event) => void state.openModel(event.currentTarget.value)}>
      {!listed && <option value={open?.name ?? ''}>{open?.summary.label ?? state.upload.value?.file.name ?? 'none yet'}</option>}
      {models.map((one) => <option value={one.name}>{state.nameOf(one)}{made(one)}</option>)}</select></label>
    <Sides />
    <label>New: drop a mesh or material file anywhere, or <input type="file" onChange={(event) => choose(event.currentTarget.files)} /></label>
    <label>its unit <select value={unit} onChange={(event) => { state.unit.value = Number(event.currentTarget.value); }}>
      {UNITS.map(([name, metres]) => <option value={metres}>{name}</option>)}</select></label>
    <label>of <select value={state.newMaterial.value} onChange={(event) => { state.newMaterial.value = event.currentTarget.value; }}>
      {state.materials.value.map(({ name }) => <option value={name}>{name.replaceAll('_', ' ')}</option>)}</select></label>
    <label class="tick"><input type="checkbox" checked={repair} onChange={(event) => setRepair(event.currentTarget.checked)} /> repair</label>
  </section>;
}

/** The box around the body, in metres or millimetres. */
function Sides() {
  const sides = state.sidesM.value;
  if (!sides) return null;
  const [factor, unit] = Math.max(...sides) < 1 ? [1000, 'mm'] : [1, 'm'];
  return <span class="sides">{sides.map((side) => Number((side * factor).toPrecision(3))).join(' × ')} {unit}</span>;
}

/** Why a file was refused, in its own unit, and the remedies of which the page knows the field, as buttons. */
function Refusal({ upload }: { upload: state.Upload }) {
  const again = (text: string, change: Partial<state.Upload>) => <button onClick={() => { state.unit.value = change.unit ?? state.unit.value; void state.createModel({ ...upload, ...change }); }}>{text}</button>;
  const { message, remedies = [] } = upload.refusal!;
  const unit = UNITS.find(([, metres]) => metres === upload.unit)![0];
  return <p class="fault" role="alert">{upload.unit && upload.unit !== 1 ? inUnitOf(upload.unit, unit, message) : message}{' '}
    {remedies.map(({ field, value }) => field === 'settings.mesh.repair' ? again('Repair it', { repair: true })
      : field === 'settings.metres_per_unit' && Number(value) > 0 ? again(Number(value) === 1 ? 'It is in metres' : 'It is in millimetres', { unit: Number(value) })
        : null)}</p>;
}

function News() {
  const job = state.job.value, upload = state.upload.value;
  const progress = job?.progress;
  const place = state.strike.value?.point.map((metres) => (1000 * metres * state.size.value).toFixed(1)).join(', ');
  return <div class="news" role="status">
    {job && <p><progress aria-label="Progress" value={progress?.fraction ?? 0} /> {progress?.phase ? Phase[progress.phase]!.toLowerCase() : job.wait?.runningJobLabel ? `waiting for ${job.wait.runningJobLabel}` : 'waiting'}
      {progress?.remainingS ? `, ${Math.ceil(progress.remainingS)} s left` : ''}
      {progress?.convergedModeCount ? `, ${progress.convergedModeCount} modes` : ''}{state.coarse.value ? '; strike the coarse body now' : ''}
      {' '}<button onClick={() => void state.services.jobs.cancelJob({ name: job.name }).catch(state.showFault)}>Cancel</button></p>}
    {!job && state.busy.value && <p>{state.busy.value} …</p>}
    {state.fault.value && <p class="fault" role="alert">{state.fault.value.message}</p>}
    {upload?.refusal && <Refusal upload={upload} />}
    {!state.reached.value && <p class="fault">The console is not reached; it is tried again.</p>}
    {upload && !job && !upload.refusal && <p>uploading {upload.file.name} …</p>}
    {!job && !state.busy.value && !state.fault.value && !upload && <p>{place ? `Point ${place} mm` : state.model.value ? 'Click a point of the body to hear it.' : 'Drop a mesh file anywhere.'}</p>}
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
