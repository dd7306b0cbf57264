// SPDX-License-Identifier: Apache-2.0
// A modal model in the browser: its surface, mode shapes, and what follows from them and a material.
import type { Material } from './gen/carillon/v1/material_pb';
import type { ModalModelHeader } from './gen/carillon/v1/modal_model_pb';
import type { ModalModelSummary, TransferSummary } from './gen/carillon/v1/modal_model_service_pb';
import { ElementType } from './gen/carillon/v1/modal_model_pb';
import type { Services } from './services';

const SIXTY_DB = Math.log(1000);
/** As the daemon has it: how far the speed of sound of a material may be from that of a transfer, as a difference of logarithms. */
const SPEED_TOLERANCE = 0.05;

/** Shapes that a page keeps: those of 64 modes of 100,000 vertices have 38 MB. */
const MOST_SHAPES = 64;

/** A shape as the daemon sends it: x, y and z of each vertex times the scale, 1/kg^(1/2), for unit density. */
export interface Shape {
  scale: number;
  components: Int16Array;
}

/** The mode shapes of a model, which are fetched as they are needed. */
export class Shapes {
  private readonly kept = new Map<number, Shape>();

  constructor(private readonly services: Services, private readonly name: string, private readonly vertexCount: number) {}

  get(mode: number): Shape | undefined {
    return this.kept.get(mode);
  }

  /** Fetches those of the modes that are not kept. */
  async fetch(modes: number[]): Promise<void> {
    const missing = modes.filter((mode) => !this.kept.has(mode));
    if (!missing.length) return;
    const parts = new Map<number, { scale: number; bytes: Uint8Array; first: number }[]>();
    for await (const { shapes } of this.services.models.getShapes({ name: this.name, modes: missing })) {
      for (const { mode, scale, components, firstVertex } of shapes) {
        parts.set(mode, [...parts.get(mode) ?? [], { scale, bytes: components, first: firstVertex }]);
      }
    }
    for (const [mode, of] of parts) this.kept.set(mode, this.joined(of));
    for (const oldest of this.kept.keys()) {
      if (this.kept.size <= MOST_SHAPES) break;
      this.kept.delete(oldest);
    }
  }

  /** The shapes of all modes at a vertex: x, y and z for each mode. */
  async at(vertex: number): Promise<Float32Array> {
    const row: number[] = [];
    for await (const { shapes } of this.services.models.getShapes({ name: this.name, vertices: [vertex] })) {
      for (const { scale, components } of shapes) row.push(...Array.from(integers(components), (value) => value * scale));
    }
    return new Float32Array(row);
  }

  /** Parts of a large shape have scales of their own. */
  private joined(parts: { scale: number; bytes: Uint8Array; first: number }[]): Shape {
    if (parts.length === 1) return { scale: parts[0]!.scale, components: integers(parts[0]!.bytes) };
    const scale = Math.max(...parts.map((part) => part.scale));
    const components = new Int16Array(3 * this.vertexCount);
    for (const part of parts) {
      components.set(integers(part.bytes).map((value) => Math.round(value * part.scale / scale)), 3 * part.first);
    }
    return { scale, components };
  }
}

/** A copy, because bytes of a message may lie at an odd place of their buffer. */
function integers(bytes: Uint8Array): Int16Array {
  return new Int16Array(bytes.slice().buffer);
}

export interface ModalModel extends Surface {
  name: string;
  summary: ModalModelSummary;
  shapes: Shapes;
  modeCount: number;
}

/** A mode as it sounds with a material and a size. */
export interface SoundingMode {
  index: number;
  frequencyHz: number;
  /** The true frequency lies at most this far below, relative. */
  error: number;
  decayPerS: number;
  t60S: number;
  /** Pressure at 1 m of an impulse, Pa, root mean square over directions. */
  levelPa: number;
  /** The displacement of the struck point, and its part along the blow, as shares of the root mean square over the body. */
  moves: number;
  movesAlong: number;
}

const BYTES = { [ElementType.FLOAT32]: 4, [ElementType.FLOAT64]: 8, [ElementType.UINT32]: 4 } as Record<number, number>;

/** What a picture of a body needs of its model. */
export interface Surface {
  header: ModalModelHeader;
  vertices: Float32Array;
  triangles: Uint32Array;
  eigenvalues: Float64Array;
  couplings: Float64Array;
}

export async function fetchSurface(services: Services, name: string): Promise<Surface> {
  let header: ModalModelHeader | undefined;
  let arrays: Uint8Array[] = [];
  let received = 0, total = 1;
  for await (const { record } of services.models.exportModalModel({ name, withoutShapes: true })) {
    if (record?.record.case === 'header') {
      header = record.record.value;
      arrays = header.arrays.map((array) =>
        new Uint8Array(array.shape.reduce((product, side) => product * Number(side), 1) * BYTES[array.type]!));
      total = arrays.reduce((sum, array) => sum + array.length, 0);
    } else if (record?.record.case === 'chunk') {
      const { array, offset, data } = record.record.value;
      arrays[array]!.set(data, Number(offset));
      received += data.length;
    }
  }
  if (!header || received !== total) throw new Error('the model did not come whole; try again');
  const bytesOf = (wanted: string) => arrays[header!.arrays.findIndex((array) => array.name === wanted)]!.buffer;
  return {
    header, vertices: new Float32Array(bytesOf('vertices')), triangles: new Uint32Array(bytesOf('triangles')),
    eigenvalues: new Float64Array(bytesOf('eigenvalues')), couplings: new Float64Array(bytesOf('couplings')),
  };
}

/** Fetches a model without its shapes. */
export async function fetchModel(services: Services, name: string): Promise<ModalModel> {
  const [{ modalModel }, surface] = await Promise.all([services.models.getModalModel({ name }), fetchSurface(services, name)]);
  return { name, summary: modalModel!, ...surface, modeCount: surface.header.modeCount,
    shapes: new Shapes(services, name, surface.vertices.length / 3) };
}

function lossFactorAt(material: Material, frequencyHz: number): number {
  const points = material.lossFactor;
  const after = points.findIndex((point) => point.frequencyHz >= frequencyHz);
  if (after === 0 || points.length === 1) return points[0]!.lossFactor;
  if (after < 0) return points.at(-1)!.lossFactor;
  const [low, high] = [points[after - 1]!, points[after]!];
  const share = Math.log(frequencyHz / low.frequencyHz) / Math.log(high.frequencyHz / low.frequencyHz);
  return low.lossFactor * (high.lossFactor / low.lossFactor) ** share;
}

function decayOf(material: Material, omega: number): number {
  const eigenvalue = omega * omega;
  if (material.lossFactor.length) return lossFactorAt(material, omega / (2 * Math.PI)) * omega / 2;
  return ((material.alpha1S ?? 0) * eigenvalue + (material.alpha2PerS ?? 0)) / 2;
}

/** The transfer by which an object of the material sounds, if one is stored. */
export function fittingTransfer({ transfers }: ModalModelSummary, material: Material): TransferSummary | undefined {
  const speed = Math.sqrt((material.youngPa ?? 1) / (material.densityKgPerM3 ?? 1));
  const distance = ({ header }: TransferSummary) => Math.abs(Math.log(speed / (header!.speedRatio * header!.soundSpeedMPerS)));
  return transfers.filter((one) => one.powerIntegrals.length && distance(one) <= SPEED_TOLERANCE)
    .sort((a, b) => distance(a) - distance(b))[0];
}

/** The modes up to 20 kHz, as an impulse (N s) at the point whose shapes are `row` excites them; without one levels are 0. */
export function soundingModes(model: ModalModel, material: Material, size: number,
    strike?: { row: Float32Array; impulse: [number, number, number] }): SoundingMode[] {
  const density = material.densityKgPerM3 ?? 1;
  const scale = (material.youngPa ?? 1) / (density * size * size);
  const transfer = fittingTransfer(model.summary, material), air = transfer?.header;
  const rootVolume = Math.sqrt(model.header.volumeM3);
  const modes: SoundingMode[] = [];
  for (let index = 0; index < model.modeCount; index += 1) {
    const omega = Math.sqrt(model.eigenvalues[index]! * scale);
    if (omega > 2 * Math.PI * 20000) break;
    const integral = transfer?.powerIntegrals[index] ?? 0;
    // transfer.proto has the formulas of the radiated power.
    const decayPerS = decayOf(material, omega)
      + (air ? air.airDensityKgPerM3 * omega * omega * size * integral / (2 * air.soundSpeedMPerS * density) : 0);
    let levelPa = 0, moves = 0, movesAlong = 0;
    if (strike) {
      let force = 0;
      for (let axis = 0; axis < 3; axis += 1) {
        force += strike.impulse[axis]! * strike.row[3 * index + axis]!;
      }
      moves = rootVolume * Math.hypot(...strike.row.subarray(3 * index, 3 * index + 3));
      movesAlong = rootVolume * Math.abs(force) / Math.hypot(...strike.impulse);
      const amplitude = Math.abs(force) / Math.sqrt(density * size ** 3) / omega;
      // Without a transfer the paper's coupling takes its place, by its level in docs/physics.md.
      levelPa = air
        ? air.airDensityKgPerM3 * omega * omega * Math.sqrt(integral * size / (4 * Math.PI * density)) * amplitude
        : 602 * Math.abs(model.couplings[index]!) * Math.sqrt(material.youngPa ?? 1) / density / Math.sqrt(size) * amplitude;
    }
    modes.push({ index, frequencyHz: omega / (2 * Math.PI), error: model.header.estimatedErrors[index] ?? 0, decayPerS,
      t60S: SIXTY_DB / decayPerS, levelPa, moves, movesAlong });
  }
  return modes;
}

/** The frequency of the lowest mode of the body with a material and a size, Hz. */
export function lowestHz(model: ModalModel, material: Material, size: number): number {
  return Math.sqrt(model.eigenvalues[0]! * (material.youngPa ?? 1) / (material.densityKgPerM3 ?? 1)) / size / (2 * Math.PI);
}

const NOTES = ['C', 'C#', 'D', 'D#', 'E', 'F', 'F#', 'G', 'G#', 'A', 'A#', 'B'];

/** The frequency that 'A4', 'Bb4', 'A4 +20' (cents) or '440 Hz' names, Hz. */
export function hzOf(text: string): number | undefined {
  const [, letter, sign, octave, cents] = /^([A-G])(#|♯|b|♭)?(\d)(?:\s*([+−-]\s*\d+))?$/i.exec(text.trim()) ?? [];
  const semitones = letter ? NOTES.indexOf(letter.toUpperCase()) + (!sign ? 0 : /[#♯]/.test(sign) ? 1 : -1) + 12 * (Number(octave) + 1) - 69 : 0;
  const hz = letter ? 440 * 2 ** ((semitones + Number((cents ?? '0').replace('−', '-').replace(/\s/g, '')) / 100) / 12)
    : Number(text.trim().replace(/\s*hz$/i, ''));
  return hz > 0 ? hz : undefined;
}

/** The nearest note and the cents from it: 'A4 +3'; empty for what is too low to be one. */
export function noteOf(frequencyHz: number): string {
  if (frequencyHz < 16) return '';
  const number = 69 + 12 * Math.log2(frequencyHz / 440);
  const nearest = Math.round(number);
  const cents = Math.round(100 * (number - nearest));
  return `${NOTES[((nearest % 12) + 12) % 12]}${Math.floor(nearest / 12) - 1} ${cents < 0 ? '−' : '+'}${Math.abs(cents)}`;
}
