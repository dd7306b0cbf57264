// SPDX-License-Identifier: Apache-2.0
/** Checks of the caller's arguments. Their messages have the caller's own names, and the units. */
'use strict';

const util = require('util');
const { message } = require('./contract');

/** "1 contact", "2 contacts". */
function counted(count, noun) {
  return Number(count) === 1 ? `${count} ${noun}` : `${count} ${noun}s`;
}

/** The number of letters to insert, remove or replace between two words. */
function distance(one, other) {
  let row = Array.from({ length: other.length + 1 }, (_, i) => i);
  for (let i = 1; i <= one.length; i += 1) {
    const next = [i];
    for (let j = 1; j <= other.length; j += 1) {
      next.push(Math.min(row[j] + 1, next[j - 1] + 1, row[j - 1] + (one[i - 1] === other[j - 1] ? 0 : 1)));
    }
    row = next;
  }
  return row[other.length];
}

/** The one of the names that is most like the word; undefined if none is much like it. */
function nearest(word, names) {
  const found = names.map((right) => ({ right, far: right.startsWith(word) ? 1 : distance(word, right) }))
    .sort((one, other) => one.far - other.far)[0];
  return found && found.far <= Math.max(2, word.length / 3) ? found.right : undefined;
}

function hint(name, known) {
  const names = known.filter((right) => !right.startsWith('_')); // without those that only the daemon uses
  // The contract writes max_frequency_hz where this package has maxFrequencyHz.
  const near = nearest(name.replace(/_([a-z])/g, (_, letter) => letter.toUpperCase()), names);
  return near === undefined ? `it has ${names.sort().join(', ')}` : `did you mean "${near}"?`;
}

/** How a caller gives a field of the messages within a message, such as "settings: { poissonRatio: ... }". */
function places(type, name) {
  const found = [];
  for (const field of message(type).type.field) {
    if (field.type === 'TYPE_MESSAGE' && field.label !== 'LABEL_REPEATED') {
      const inner = field.typeName.split('.').at(-1);
      const own = message(inner).type.field.some((other) => other.name === name) ? [`${name}: ...`] : [];
      found.push(...[...own, ...places(inner, name)].map((place) => `${field.name}: { ${place} }`));
    }
  }
  return found;
}

/** Throws a TypeError if a value that is to have keys, such as the first of those known, is given and is no object. */
function refuseNoObject(given, known, where) {
  if (given === undefined || (given !== null && typeof given === 'object')) return;
  throw new TypeError(`${where} is given ${show(given)}; give an object, such as { ${known[0]}: ... }`);
}

/**
 * Throws a TypeError with the nearest known name if an object has a key that is unknown. If it is known within a message
 * of the contract that the object stands for, of the name `type`, the error says where.
 */
function refuseUnknown(given, known, where, type = undefined) {
  refuseNoObject(given, known, where);
  for (const name in given) {
    if (!known.includes(name)) {
      const right = type === undefined ? [] : places(type, name);
      const repair = right.length ? `give it as ${right.join(' or ')}` : hint(name, known);
      throw new TypeError(`${where} has no "${name}"; ${repair}`);
    }
  }
}

function show(value) {
  const text = util.inspect(value, { breakLength: Infinity });
  return text.length <= 80 ? text : `${text.slice(0, 77)}...`;
}

function refuse(value, name, wanted) {
  throw new TypeError(`${name} is ${show(value)}; it must be ${wanted}`);
}

const NUMBERS = new Set(['TYPE_DOUBLE', 'TYPE_FLOAT', 'TYPE_UINT32', 'TYPE_INT32']);
const MOST_OF_32_BITS = 2 ** 32 - 1;

/** Throws a TypeError unless a value is a whole number of 32 bits, as handles and partners are. Returns it. */
function whole(value, name, wanted) {
  if (!Number.isInteger(value) || value < 0 || value > MOST_OF_32_BITS) refuse(value, name, wanted);
  return value;
}

/** Throws a TypeError if an object is no message of the contract: by an unknown field, word or kind of value. */
function refuseNoMessage(given, type, where, more = []) {
  const { field: fields, oneofDecl: choices } = message(type).type;
  // The messages that come from the daemon also tell which field of a choice they have.
  const names = [...fields, ...choices].map((item) => item.name);
  refuseUnknown(given, [...names, ...fields.map((field) => `_${field.name}`), ...more], where, type);
  for (const field of fields) {
    const value = given[field.name];
    const isAbsent = value === undefined || value === null;
    if (!isAbsent && field.label !== 'LABEL_REPEATED') refuseWrongField(value, field, where);
  }
}

function refuseWrongField(value, field, where) {
  const name = `${field.name} of ${where}`;
  if (NUMBERS.has(field.type) && typeof value !== 'number') refuse(value, name, 'a number');
  if (field.type === 'TYPE_UINT32') whole(value, name, 'a whole number, zero or more');
  if (field.type === 'TYPE_STRING' && typeof value !== 'string') refuse(value, name, 'text');
  if (field.type === 'TYPE_ENUM' && typeof value === 'string') {
    const words = message(field.typeName.split('.').at(-1)).type.value.map((item) => item.name);
    if (!words.includes(value)) refuse(value, name, `one of ${words.join(', ')}`);
  }
  if (field.type === 'TYPE_MESSAGE') {
    if (typeof value !== 'object') refuse(value, name, `a ${field.typeName} of the contract`);
    refuseNoMessage(value, field.typeName.split('.').at(-1), field.name);
  }
}

/** The name in the contract of a word of the caller, such as "scene"; undefined if there is none. */
function choice(given, words, prefix, name) {
  if (given === undefined || given === null) return undefined;
  const word = typeof given === 'string' ? given.toLowerCase() : given;
  if (!words.includes(word)) refuse(given, name, `one of ${words.map((right) => `"${right}"`).join(', ')}`);
  return prefix + word.toUpperCase();
}

const GAIN = 'a number. A gain is a linear factor: 1 keeps the level, and 10 ** (x / 20) changes it by x decibels';

/** Throws a TypeError if one of the values, by their names, is given and is no number. */
function refuseNoNumbers(values, where) {
  for (const [name, value] of Object.entries(values)) {
    const isAbsent = value === undefined || value === null;
    const wanted = name === 'gain' ? GAIN : 'a number';
    if (!isAbsent && typeof value !== 'number') refuse(value, `${name} of ${where}`, wanted);
  }
}

/** Throws a TypeError unless the values are `count` numbers. Returns them. */
function tuple(values, count, name, meaning) {
  const isTuple = values !== null && typeof values === 'object' && values.length === count;
  for (let i = 0; i < count; i += 1) if (!isTuple || typeof values[i] !== 'number') refuse(values, name, meaning);
  return values;
}

module.exports = { choice, counted, nearest, refuse, refuseNoMessage, refuseNoNumbers, refuseNoObject, refuseUnknown,
  tuple, whole };
