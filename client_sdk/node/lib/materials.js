// SPDX-License-Identifier: Apache-2.0
'use strict';

/** A name of the catalogue becomes a message; a message stays as it is. */
function toMaterial(material) {
  return typeof material === 'string' ? { preset: material } : material;
}

/**
 * The name of a model and the material to sound with: the one given, or the one that the model was asked for with.
 * Without either the daemon chooses, which remembers it, too.
 */
function named(model, material) {
  const name = typeof model === 'string' ? model : model.name;
  const chosen = material ?? (typeof model === 'string' ? undefined : model.material);
  return chosen === undefined ? { modal_model: name } : { modal_model: name, material: toMaterial(chosen) };
}

/** "radiated_power" becomes the name in the contract. */
function toRadiation(name) {
  return name && `RADIATION_MODEL_${name.toUpperCase()}`;
}

module.exports = { named, toMaterial, toRadiation };
