// SPDX-License-Identifier: Apache-2.0
'use strict';

const { choice, refuse, refuseNoMessage } = require('./checks');

/**
 * A name of the catalogue becomes a message, and so do the materials of regions, { regions: { head: 'oak' } }; a message
 * stays as it is.
 */
function toMaterial(material) {
  if (typeof material === 'string') return { preset: material };
  if (material === null || typeof material !== 'object') {
    refuse(material, 'material', "a name such as 'oak', or figures such as { youngPa, densityKgPerM3 }");
  }
  if (material.regions && !Array.isArray(material.regions)) {
    const regions = Object.entries(material.regions).map(([region, own]) => ({ region, material: toMaterial(own) }));
    return toMaterial({ ...material, regions });
  }
  refuseNoMessage(material, 'Material', 'material');
  return material;
}

/**
 * The name of a model and the material to sound with: the one given, or the one that the model was asked for with.
 * Without either the daemon chooses, which remembers it, too.
 */
function named(model, material) {
  const name = typeof model === 'string' ? model : model?.name;
  if (typeof name !== 'string' || !name) refuse(model, 'the model', 'a Model, such as await createModel(...), or its name');
  const chosen = material ?? (typeof model === 'string' ? undefined : model.material);
  return chosen === undefined ? { modalModel: name } : { modalModel: name, material: toMaterial(chosen) };
}

/** "radiated_power" becomes the name in the contract. */
function toRadiation(name) {
  return choice(name, ['paper_coupling', 'radiated_power', 'modes_only'], 'RADIATION_MODEL_', 'radiation');
}

module.exports = { named, toMaterial, toRadiation };
