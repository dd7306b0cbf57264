// SPDX-License-Identifier: Apache-2.0
'use strict';

const { CarillonError } = require('./errors');

/** A name of the catalogue becomes a message; a message stays as it is. */
function toMaterial(material) {
  return typeof material === 'string' ? { preset: material } : material;
}

/** The name of a model and the material to sound with: the one given, or the one that the model was asked for with. */
function named(model, material) {
  const name = typeof model === 'string' ? model : model.name;
  const chosen = material ?? (typeof model === 'string' ? undefined : model.material);
  if (chosen === undefined) {
    throw new CarillonError('INVALID_MATERIAL', `no material is known for ${name}; give one, such as ` +
      '{ material: "bell_bronze" }');
  }
  return { modal_model: name, material: toMaterial(chosen) };
}

/** "radiated_power" becomes the name in the contract. */
function toRadiation(name) {
  return name && `RADIATION_MODEL_${name.toUpperCase()}`;
}

module.exports = { named, toMaterial, toRadiation };
