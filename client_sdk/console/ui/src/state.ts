// SPDX-License-Identifier: Apache-2.0
// What the page about one body knows, as signals, and what it asks of the daemon.
import { computed, signal } from '@preact/signals';
import type { MessageInitShape } from '@bufbuild/protobuf';
import type { Strike } from './body_view';
import { ConnectError } from '@connectrpc/connect';
import type { ErrorInfo, Remedy } from './gen/carillon/v1/error_pb';
import type { GetMixerResponse } from './gen/carillon/v1/audio_service_pb';
import type { Job } from './gen/carillon/v1/decomposition_pb';
import { JobState } from './gen/carillon/v1/decomposition_pb';
import type { CatalogueMaterial, Material, MaterialSchema } from './gen/carillon/v1/material_pb';
import type { ModalModelSummary } from './gen/carillon/v1/modal_model_service_pb';
import { fetchModel, soundingModes } from './modal_model';
import type { ModalModel } from './modal_model';
import { servicesOf } from './services';
import { StrikeStream } from './strike_stream';
import { Tunnel, tunnelAddress } from './tunnel';
import { errorInfo } from './transport';

const PIECE_BYTES = 1 << 20;

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

/** A mesh file that is being made a model, or was refused. */
export interface Upload { file: File; unit: number; repair: boolean; digest?: string }

export const reached = signal(false);
export const models = signal<ModalModelSummary[]>([]);
export const materials = signal<CatalogueMaterial[]>([]);
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
export const busy = signal('');
export const fault = signal<Pick<ErrorInfo, 'message'> & { remedies?: Remedy[] } | undefined>(undefined);

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
  if (!model.value || !material.value) return [];
  const at = strike.value && row.value && { row: row.value, impulse: force(strike.value) };
  return soundingModes(model.value, material.value, size.value, at);
});

/** The modes of the setting that was kept for comparison. */
export const keptModes = computed(() => {
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
let updating: Promise<void> | undefined;
let updateAgain = false;

/** The name of the page's own scene. */
export const sceneName = () => scene;

export async function attempt<T>(what: string, work: () => Promise<T>): Promise<T | undefined> {
  busy.value = what;
  fault.value = undefined;
  try {
    return await work();
  } catch (error) {
    fault.value = errorInfo(error) ?? { message: ConnectError.from(error).rawMessage };
    return undefined;
  } finally {
    busy.value = '';
  }
}

/** Makes everything anew that a lost daemon or connection took away; a daemon may come back later than the console. */
async function begin(): Promise<void> {
  if (beginning) return;
  beginning = true;
  while (reached.value) {
    const done = await attempt('reading the catalogue', async () => {
      materials.value = (await services.models.listMaterials({})).materials;
      await listModels();
      scene = (await services.scenes.createScene({})).name;
      object = '';
      strikes = new StrikeStream(services, scene, (message) => { fault.value = { message }; }, () => void begin());
      if (model.value) await addObject(model.value);
      else if (models.value[0]) await openModel(models.value[0].name);
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

export async function openModel(name: string, anew = true): Promise<void> {
  await attempt('fetching the model', async () => {
    const fetched = await fetchModel(services, name);
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
  strikes?.send(handle, at.point.map((coordinate) => coordinate * size.value) as Triple, force(at), striker.value);
}

export async function readRow(at: Strike): Promise<Float32Array | undefined> {
  const of = model.value;
  const read = await of?.shapes.at(at.vertex);
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

/** Uploads a mesh file, has it decomposed, and opens the model as soon as it can be struck. */
export async function createModel(wanted: Upload): Promise<void> {
  upload.value = wanted;
  await attempt(`uploading ${wanted.file.name}`, async () => {
    const meshDigest = wanted.digest ?? (await services.models.uploadMesh(pieces(wanted.file))).meshDigest;
    upload.value = { ...wanted, digest: meshDigest };
    const created = await services.models.createModalModel({ meshDigest, coarseFirst: true,
      label: wanted.file.name.replace(/\.[^.]*$/, ''), meshFormat: formatOf(wanted.file),
      settings: { metresPerUnit: wanted.unit, mesh: { repair: wanted.repair } },
      material: { preset: materialName.value || 'structural_steel' } });
    await follow(created.job!);
  });
}

async function follow(begun: Job): Promise<void> {
  let now = begun;
  let opened = false;
  try {
    for await (const { job: news } of services.jobs.watchJob({ name: now.name })) {
      job.value = now = news!;
      if (now.coarseReady && !opened) {
        opened = true;
        await openModel(now.modalModel);
        coarse.value = true;
      }
    }
  } finally {
    job.value = undefined;
  }
  if (now.state !== JobState.SUCCEEDED) {
    fault.value = now.error ?? { message: 'the job was cancelled' };
    return;
  }
  await listModels();
  await openModel(now.modalModel, !opened);
  coarse.value = false;
  upload.value = undefined;
}

setInterval(async () => {
  if (reached.value) mixer.value = await services.audio.getMixer({}).catch(() => undefined);
}, 1000);
