// SPDX-License-Identifier: Apache-2.0
// The file of a material that `carillon material fit --out` writes: a Material in protobuf's text format.
import { create } from '@bufbuild/protobuf';
import { CatalogueMaterialSchema, MaterialSchema } from './gen/carillon/v1/material_pb';
import type { CatalogueMaterial } from './gen/carillon/v1/material_pb';

export const isMaterialFile = (file: File) => file.name.toLowerCase().endsWith('.textproto');

function figure(text: string, name: string): number | undefined {
  const found = new RegExp(`\\b${name}:\\s*([^\\s}]+)`).exec(text);
  return found ? Number(found[1]) : undefined;
}

/** Reads a material, under the name of its file; throws an error if the file has none. */
export async function readMaterial(file: File): Promise<CatalogueMaterial> {
  const text = (await file.text()).replace(/#.*$/gm, ''), points = /loss_factor\s*\{([^}]*)\}/g;
  const lossFactor = [...text.matchAll(points)].map(([, of]) => ({ frequencyHz: figure(of!, 'frequency_hz') ?? 0,
    lossFactor: figure(of!, 'loss_factor') ?? NaN }));
  const rest = text.replace(points, '');
  const material = create(MaterialSchema, { youngPa: figure(rest, 'young_pa'), poissonRatio: figure(rest, 'poisson_ratio'),
    densityKgPerM3: figure(rest, 'density_kg_per_m3'), alpha1S: figure(rest, 'alpha1_s') ?? 0, alpha2PerS: figure(rest, 'alpha2_per_s') ?? 0,
    lossFactor });
  const figures = [material.youngPa, material.densityKgPerM3, material.alpha1S, material.alpha2PerS, ...lossFactor.map((point) => point.lossFactor)];
  if (!figures.every(Number.isFinite)) throw new Error(`${file.name} is no material with young_pa and density_kg_per_m3, as carillon material fit --out writes it`);
  return create(CatalogueMaterialSchema, { name: file.name.replace(/\.[^.]*$/, ''), material });
}
