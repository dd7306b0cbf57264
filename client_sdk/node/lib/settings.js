// SPDX-License-Identifier: Apache-2.0
/** The settings of a decomposition that callers give most, without the messages around them. */
'use strict';

const { refuse } = require('./checks');

const METRES = new Map([['m', 1], ['cm', 0.01], ['mm', 0.001], ['in', 0.0254]]);

function metresOf(unit) {
  const metres = typeof unit === 'string' ? METRES.get(unit) : unit;
  if (typeof metres !== 'number' || !(metres > 0 && metres < Infinity)) {
    refuse(unit, 'unit', '"m", "cm", "mm", "in", or a number of metres above zero');
  }
  return metres;
}

function refuseTwice(name, field, value) {
  if (value) throw new TypeError(`${name} and settings.${field} are both given; leave one of them out`);
}

/** Returns the settings with a unit and an accuracy. Throws a TypeError if the settings have them, too. */
function toSettings(settings, unit, accuracy) {
  const made = { ...settings };
  if (unit !== undefined) {
    refuseTwice('unit', 'metresPerUnit', made.metresPerUnit);
    made.metresPerUnit = metresOf(unit);
  }
  if (accuracy !== undefined) {
    refuseTwice('accuracy', 'mesh.accuracy', made.mesh?.accuracy);
    if (typeof accuracy !== 'number' || !(accuracy > 0 && accuracy < 1)) {
      refuse(accuracy, 'accuracy', 'a number above 0 and below 1, such as 0.01 for 1 %');
    }
    made.mesh = { ...made.mesh, accuracy };
  }
  return unit === undefined && accuracy === undefined ? settings : made;
}

module.exports = { toSettings };
