// SPDX-License-Identifier: Apache-2.0
// What the page about one body knows, as signals, and what it asks of the daemon.
import { computed, effect, signal } from '@preact/signals';
import { equals } from '@bufbuild/protobuf';
import type { MessageInitShape } from '@bufbuild/protobuf';
import type { Strike } from './body_view';
import { ConnectError } from '@connectrpc/connect';
import type { ErrorInfo, Remedy } from './gen/carillon/v1/error_pb';
import type { GetMixerResponse } from './gen/carillon/v1/audio_service_pb';
import type { Job } from './gen/carillon/v1/decomposition_pb';
import { JobKind, JobState } from './gen/carillon/v1/decomposition_pb';
import type { CatalogueMaterial, Material, MaterialSchema } from './gen/carillon/v1/material_pb';
import { DecompositionSettingsSchema } from './gen/carillon/v1/modal_model_pb';
import type { ModalModelSummary } from './gen/carillon/v1/modal_model_service_pb';
import { readMaterial } from './material_file';
import { previewOf } from './mesh_preview';
import type { Preview } from './mesh_preview';
import { fetchModel, fittingTransfer, soundingModes } from './modal_model';
import type { ModalModel } from './modal_model';
import { servicesOf } from './services';
import { StrikeStream } from './strike_stream';
import { Tunnel, tunnelAddress } from './tunnel';
import { errorInfo } from './transport';

const PIECE_BYTES = 1 << 20;
const MOST_JOBS = 50;

/** What is struck, and how; two of these are compared. */
export interface Setting {
  model: ModalModel;
  materialName: string;
  factors: Factors;
  size: number;
  striker: string;
  impulse: number;
  strike?: Strike;
  row?: Float32Array;
}

/** What the figures of a material are multiplied with. */
export interface Factors { young: number; density: number; damping: number }
export const UNCHANGED: Factors = { young: 1, density: 1, damping: 1 };

type Fault = Pick<ErrorInfo, 'message'> & { remedies?: Remedy[] };

/** A mesh file that is being made a model, or was refused. Its unit in metres is 0 if nobody has said it. */
export interface Upload { file: File; unit: number; repair: boolean; digest?: string; preview?: Preview; refusal?: Fault }

/** A choice that outlives the page. */
function remembered<T>(name: string, first: T) {
  const choice = signal<T>(JSON.parse(localStorage.getItem(name) ?? JSON.stringify(first)));
  effect(() => localStorage.setItem(name, JSON.stringify(choice.value)));
  return choice;
}

export const reached = signal(false);
export const unit = remembered('unit', 0);
export const newMaterial = remembered('material', 'structural_steel');
export const models = signal<ModalModelSummary[]>([]);
export const materials = signal<CatalogueMaterial[]>([]);
/** Materials of files, which the daemon does not know by name. */
const ownMaterials = new Map<string, CatalogueMaterial>();
export const mixer = signal<GetMixerResponse | undefined>(undefined);
export const model = signal<ModalModel | undefined>(undefined);
export const coarse = signal(false);
export const materialName = signal('');
export const factors = signal(UNCHANGED);
export const size = signal(1);
export const striker = signal('steel');
export const impulse = signal(0.02);
export const strike = signal<Strike | undefined>(undefined);
/** The shapes of all modes at the point that is struck. */
export const row = signal<Float32Array | undefined>(undefined);
export const chosenMode = signal<number | undefined>(undefined);
export const kept = signal<Setting | undefined>(undefined);
export const upload = signal<Upload | undefined>(undefined);
export const job = signal<Job | undefined>(undefined);
/** The newest jobs by name. */
export const jobs = signal<Map<string, Job>>(new Map());
/** Counts the transfers that have come for models that are open. */
const transferCount = signal(0);
export const busy = signal('');
export const fault = signal<Fault | undefined>(undefined);

export const material = computed<Material | undefined>(() => {
  const found = materials.value.find((entry) => entry.name === materialName.value)?.material;
  return found && changed(found, factors.value);
});

function changed(of: Material, by: Factors): Material {
  return { ...of, youngPa: (of.youngPa ?? 0) * by.young, densityKgPerM3: (of.densityKgPerM3 ?? 0) * by.density,
    alpha1S: (of.alpha1S ?? 0) * by.damping, alpha2PerS: (of.alpha2PerS ?? 0) * by.damping,
    lossFactor: of.lossFactor.map((point) => ({ ...point, lossFactor: Math.min(1.99, point.lossFactor * by.damping) })) };
}

export const modes = computed(() => {
  transferCount.value;
  if (!model.value || !material.value) return [];
  const at = strike.value && row.value && { row: row.value, impulse: force(strike.value) };
  return soundingModes(model.value, material.value, size.value, at);
});

/** Whether the levels and the decays of the modes are those of a transfer, or the job that computes it. */
export const radiation = computed<'included' | 'absent' | Job>(() => {
  transferCount.value;
  const of = model.value;
  if (of && material.value && fittingTransfer(of.summary, material.value)) return 'included';
  return [...jobs.value.values()].find((one) => one.kind === JobKind.TRANSFER && one.modalModel === of?.name
    && (one.state === JobState.QUEUED || one.state === JobState.RUNNING)) ?? 'absent';
});

/** Asks for the radiation of the body that is open, in its material. */
export async function computeRadiation(): Promise<void> {
  await attempt('', () => services.models.createTransfer({ modalModel: model.value!.name, material: materialOfObject(),
    size: size.value, label: `${nameOf(model.value!.summary)} (transfer)` }));
}

/** The sides of the box around the body that is drawn, m. */
export const sidesM = computed<Triple | undefined>(() => {
  if (upload.value?.preview) return upload.value.preview.sides.map((side) => side * (upload.value!.unit || 1)) as Triple;
  const of = model.value?.vertices;
  if (!of) return undefined;
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < of.length; i += 1) {
    low[i % 3] = Math.min(low[i % 3]!, of[i]!);
    high[i % 3] = Math.max(high[i % 3]!, of[i]!);
  }
  return high.map((side, axis) => (side - low[axis]!) * size.value) as Triple;
});

/** The modes of the setting that was kept for comparison. */
export const keptModes = computed(() => {
  transferCount.value;
  const one = kept.value;
  const found = one && materials.value.find((entry) => entry.name === one.materialName)?.material;
  if (!one || !found) return [];
  const at = one.strike && one.row && { row: one.row, impulse: one.strike.normal.map((n) => -n * one.impulse) as Triple };
  return soundingModes(one.model, changed(found, one.factors), one.size, at);
});

type Triple = [number, number, number];

/** The impulse of a strike, N s, inwards. */
function force(at: Strike): Triple {
  return at.normal.map((n) => -n * impulse.value) as Triple;
}

const tunnel = new Tunnel(tunnelAddress(), (open) => {
  reached.value = open;
  if (open) void begin();
});
export const services = servicesOf(tunnel);

let beginning = false;
let scene = '';
let object = '';
let handle = 0;
let strikes: StrikeStream | undefined;
/** The newest strike on a scene that does not have its object yet. */
let waiting: Strike | undefined;
let updating: Promise<void> | undefined;
let updateAgain = false;

/** The name of the page's own scene. */
export const sceneName = () => scene;

const faultOf = (error: unknown): Fault => errorInfo(error) ?? { message: ConnectError.from(error).rawMessage };

/** Says why a call failed. */
export const showFault = (error: unknown): void => { fault.value = faultOf(error); };

export async function attempt<T>(what: string, work: () => Promise<T>): Promise<T | undefined> {
  busy.value = what;
  fault.value = undefined;
  try {
    return await work();
  } catch (error) {
    showFault(error);
    return undefined;
  } finally {
    busy.value = '';
  }
}

function takeMaterials(named: CatalogueMaterial[]): void {
  materials.value = [...named.filter(({ name }) => !ownMaterials.has(name)), ...ownMaterials.values()];
}

/** Lists the material of a file beside the named ones, and lets the body that is open have it. */
export const takeMaterial = (file: File): Promise<void> => attempt('reading the material', async () => {
  const own = await readMaterial(file);
  ownMaterials.set(own.name, own);
  takeMaterials(materials.value);
  newMaterial.value = materialName.value = own.name;
  factors.value = UNCHANGED;
  await updateObject();
});

/** Makes everything anew that a lost daemon or connection took away; a daemon may come back later than the console. */
async function begin(): Promise<void> {
  if (beginning) return;
  beginning = true;
  while (reached.value) {
    const done = await attempt('reading the catalogue', async () => {
      takeMaterials((await services.models.listMaterials({})).materials);
      if (!materials.value.some(({ name }) => name === newMaterial.value)) newMaterial.value = 'structural_steel';
      await listModels();
      strikes = undefined;
      scene = (await services.scenes.createScene({})).name;
      object = '';
      if (model.value) await addObject(model.value);
      else if (models.value[0] && !upload.value) await openModel(models.value[0].name);
      strikes = new StrikeStream(services, scene, (message) => { fault.value = { message }; }, () => void begin());
      if (waiting) sendStrike(waiting);
      waiting = undefined;
      // The daemon may have gone between a strike and its answer.
      if (strike.value && !row.value) await readRow(strike.value);
      return true;
    });
    if (done) break;
    await new Promise((resolve) => setTimeout(resolve, 300));
  }
  beginning = false;
}

export async function listModels(): Promise<void> {
  models.value = (await services.models.listModalModels({ pageSize: 200 })).modalModels;
}

const COARSE = ' (coarse)';

/** The models that a list shows: without the coarse ones whose fine ones are there, too. */
export const listedModels = computed(() => models.value.filter((one) => !one.label.endsWith(COARSE)
  || !models.value.some((fine) => fine.label + COARSE === one.label && fine.header?.meshDigest === one.header?.meshDigest)));

/** A model's label; a coarse model that stands under the name of a finer one, which was never computed, says so. */
export function nameOf(one: ModalModelSummary): string {
  const label = one.label || one.name.slice(12, 24);
  const isCoarse = models.value.some((other) => other.label === label + COARSE && other.header?.meshDigest === one.header?.meshDigest
    && other.header?.settings && one.header?.settings && equals(DecompositionSettingsSchema, other.header.settings, one.header.settings));
  return isCoarse ? label + COARSE : label;
}

let creation = new AbortController();
let opening = {};

/** Forgets a file that is being made a model: its job goes on, and the list of jobs shows it. */
function leaveUpload(): void {
  creation.abort();
  opening = {};
  upload.value = job.value = undefined;
}

/** Opens a stored model in place of what is on the page. */
export async function openModel(name: string): Promise<void> {
  leaveUpload();
  await open(name);
}

async function open(name: string, anew = true): Promise<void> {
  const mine = opening = {};
  await attempt('fetching the model', async () => {
    const fetched = await fetchModel(services, name);
    if (opening !== mine) return;
    if (anew) {
      materialName.value = fetched.summary.material?.preset || materialName.value || 'structural_steel';
      factors.value = UNCHANGED;
      size.value = 1;
      strike.value = undefined;
      coarse.value = false;
    } else if (strike.value) {
      strike.value = { ...strike.value, vertex: nearestVertex(fetched, strike.value.point) };
    }
    row.value = chosenMode.value = undefined;
    model.value = fetched;
    await addObject(fetched);
    if (strike.value) await readRow(strike.value);
  });
}

function nearestVertex(of: ModalModel, [x, y, z]: Triple): number {
  let best = 0, least = Infinity;
  for (let i = 0; i < of.vertices.length; i += 3) {
    const distance = (of.vertices[i]! - x) ** 2 + (of.vertices[i + 1]! - y) ** 2 + (of.vertices[i + 2]! - z) ** 2;
    if (distance < least) { least = distance; best = i / 3; }
  }
  return best;
}

/** How far the frequencies of a body may be off, relative, because it was computed for another Poisson's ratio. */
export const ratioError = computed(() => {
  const header = model.value?.header, computedFor = header?.settings?.poissonRatio, wanted = material.value?.poissonRatio;
  if (!header || computedFor === undefined || wanted === undefined) return 0;
  // Torsion, which goes as (1 + nu)^(-1/2), is a bound where a model has no slopes.
  const slopes = header.poissonSlopes.length ? header.poissonSlopes : [1 / (1 + computedFor)];
  return Math.max(...slopes.map(Math.abs)) * Math.abs(wanted - computedFor) / 2;
});

/** The material as the daemon gets it: without its Poisson's ratio, so that the model's is taken, which a preset must not differ from. */
function materialOfObject(): MessageInitShape<typeof MaterialSchema> {
  if (!material.value) return { preset: materialName.value };
  const { youngPa, densityKgPerM3, alpha1S, alpha2PerS, lossFactor } = material.value;
  return { youngPa, densityKgPerM3, alpha1S, alpha2PerS, lossFactor };
}

async function addObject(of: ModalModel): Promise<void> {
  if (object) await services.scenes.removeObject({ name: object }).catch(() => {});
  const { objects } = await services.scenes.addObjects({ scene, objects: [{ modalModel: of.name,
    material: materialOfObject(), size: size.value }] });
  object = objects[0]!.name;
  handle = objects[0]!.handle;
}

/** Takes the material and the size over; at most one change is on the way, and the newest follows it. */
export function updateObject(): Promise<void> {
  if (updating) { updateAgain = true; return updating; }
  if (!model.value) return Promise.resolve();
  updating = (async () => {
    do {
      updateAgain = false;
      await attempt('', () => services.scenes.updateObject({ name: object, size: size.value, material: materialOfObject() }));
    } while (updateAgain);
    updating = undefined;
  })();
  return updating;
}

/** Sends a strike at once. What the picture and the spectrum need follows it. */
export function sendStrike(at: Strike): void {
  if (!strikes) waiting = at;
  strikes?.send(handle, at.point.map((coordinate) => coordinate * size.value) as Triple, force(at), striker.value);
}

export async function readRow(at: Strike): Promise<Float32Array | undefined> {
  const of = model.value;
  const read = await of?.shapes.at(at.vertex).catch(showFault) ?? undefined;
  if (strike.value !== at || model.value !== of) return undefined;
  return row.value = read;
}

function setting(): Setting {
  return { model: model.value!, materialName: materialName.value, factors: factors.value, size: size.value,
    striker: striker.value, impulse: impulse.value, strike: strike.value, row: row.value };
}

export function keep(): void {
  kept.value = setting();
}

/** Changes places with the setting that was kept. */
export async function swap(): Promise<void> {
  const next = kept.value!;
  kept.value = setting();
  const sameModel = next.model === model.value;
  materialName.value = next.materialName;
  factors.value = next.factors;
  size.value = next.size;
  striker.value = next.striker;
  impulse.value = next.impulse;
  model.value = next.model;
  strike.value = next.strike;
  row.value = next.row;
  chosenMode.value = undefined;
  if (sameModel) await updateObject();
  else await attempt('', () => addObject(next.model));
}

/** What a rendering of the last strike needs to know. */
export function strikeToRender() {
  const at = strike.value!;
  return { modalModel: model.value!.name, material: materialOfObject(), size: size.value,
    point: at.point.map((coordinate) => coordinate * size.value) as Triple, impulse: force(at), striker: striker.value };
}

async function* pieces(file: File) {
  for (let begin = 0; begin < file.size; begin += PIECE_BYTES) {
    yield { data: new Uint8Array(await file.slice(begin, begin + PIECE_BYTES).arrayBuffer()) };
  }
}

const formatOf = (file: File) => file.name.split('.').pop()!.toLowerCase();

/** Uploads a mesh file, has it decomposed, and opens the model as soon as it can be struck; until then no other body is on the page. */
export async function createModel(wanted: Upload): Promise<void> {
  leaveUpload();
  const { signal: left } = creation = new AbortController();
  const tell = (change: Partial<Upload>) => { if (!left.aborted) upload.value = { ...upload.value!, ...change }; };
  model.value = strike.value = row.value = chosenMode.value = fault.value = undefined;
  materialName.value = newMaterial.value;
  factors.value = UNCHANGED;
  size.value = 1;
  coarse.value = false;
  upload.value = { ...wanted, refusal: undefined };
  try {
    tell({ preview: await previewOf(wanted.file) });
    const meshDigest = wanted.digest ?? (await services.models.uploadMesh(pieces(wanted.file))).meshDigest;
    tell({ digest: meshDigest });
    const created = await services.models.createModalModel({ meshDigest, coarseFirst: true,
      label: wanted.file.name.replace(/\.[^.]*$/, ''), meshFormat: formatOf(wanted.file),
      settings: { metresPerUnit: wanted.unit, mesh: { repair: wanted.repair } },
      material: ownMaterials.get(newMaterial.value)?.material ?? { preset: newMaterial.value } });
    if (!left.aborted) await follow(created.job!, left, tell);
  } catch (error) {
    tell({ refusal: faultOf(error) });
  }
}

async function follow(begun: Job, left: AbortSignal, tell: (change: Partial<Upload>) => void): Promise<void> {
  let now = begun;
  let opened = false;
  try {
    for await (const { job: news } of services.jobs.watchJob({ name: now.name }, { signal: left })) {
      if (left.aborted) return;
      job.value = now = news!;
      if (now.coarseReady && !opened) {
        opened = true;
        await open(now.modalModel);
        if (!left.aborted) coarse.value = true;
      }
    }
  } finally {
    if (!left.aborted) job.value = undefined;
  }
  if (left.aborted) return;
  await listModels();
  if (now.state === JobState.SUCCEEDED) {
    await open(now.modalModel, !opened);
    if (left.aborted) return;
    coarse.value = false;
    upload.value = undefined;
  } else if (now.state === JobState.CANCELLED) upload.value = undefined;
  else tell({ refusal: now.error ?? { message: 'the job failed' } });
}

/** Keeps `jobs`, and what jobs bring, up to date as long as the page lives. */
async function followJobs(): Promise<void> {
  for (;;) {
    try {
      jobs.value = new Map();
      for await (const { job: news } of services.jobs.watchJobs({})) if (news) await take(news);
    } catch {
      // The daemon is away.
    }
    await new Promise((resolve) => setTimeout(resolve, 1000));
  }
}

async function take(news: Job): Promise<void> {
  const next = new Map(jobs.value).set(news.name, news);
  if (next.size > MOST_JOBS) next.delete(next.keys().next().value!);
  jobs.value = next;
  if (news.state !== JobState.SUCCEEDED) return;
  await listModels();
  for (const shown of new Set([model.value, kept.value?.model])) {
    if (news.kind !== JobKind.TRANSFER || shown?.name !== news.modalModel) continue;
    shown.summary.transfers = (await services.models.getModalModel({ name: shown.name })).modalModel!.transfers;
    transferCount.value += 1;
  }
}
void followJobs();

setInterval(async () => {
  if (reached.value) mixer.value = await services.audio.getMixer({}).catch(() => undefined);
}, 1000);
