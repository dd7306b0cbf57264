// SPDX-License-Identifier: Apache-2.0
'use strict';

const grpc = require('@grpc/grpc-js');
const { message } = require('./contract');

const DETAILS_KEY = 'grpc-status-details-bin';
// How gRPC ends a call whose message has more bytes than the daemon takes.
const TOO_LARGE = /^Received message larger than max \((\d+) vs\.? (\d+)\)/;

/**
 * A refusal. `reason` is stable and one of proto/README.md's; `message` says what was wrong, where, and how to repair
 * it; `metadata` has figures that belong to the reason, and `remedies` changes to the request that may help, as the
 * message Remedy of error.proto.
 */
class CarillonError extends Error {
  constructor(reason, text, metadata = {}, remedies = []) {
    super(`${reason}: ${text}`);
    this.name = 'CarillonError';
    this.reason = reason;
    this.metadata = metadata;
    this.remedies = remedies;
  }
}

/** No daemon answers at the address. */
class ServerUnavailable extends CarillonError {}

// The caller's names of fields and calls of the contract that messages of the daemon mention.
const CALLER_NAMES = { step_s: 'step', scheduling_delay_s: 'delay', glide_s: 'glide',
  'columns(?=\\[)': 'impulses', 'contact_columns(?=\\[)': 'contacts', 'sustained(?=\\[)': 'forces',
  'pose_columns(?=\\[)': 'poses', 'SceneService.CreateScene': 'Client.createScene()' };

/** Replaces names of the contract by those of the caller, and adds the unit, seconds, that a name loses. */
function inNamesOfCaller(text, names) {
  let made = text;
  for (const [field, name] of Object.entries(names)) {
    const unit = field.endsWith('_s') ? ' s' : '';
    made = made.replace(new RegExp(`\\b${field} is ([^ ;]+); it must be (\\S+) to (\\S+)`, 'g'),
      `${name} is $1${unit}; it must be $2 to $3${unit}`);
    made = made.replace(new RegExp(`\\b${field} is ([^ ;]+);`, 'g'), `${name} is $1${unit};`);
    made = made.replace(new RegExp(`\\b${field}\\b`, 'g'), name);
  }
  return made;
}

/** A remedy as a part of createModel's request, such as settings: { mesh: { repair: true } }. */
function settingOf({ field, value }) {
  const [name, ...inner] = field.split('.');
  return `${name}: ${inner.reduceRight((made, part) => `{ ${part}: ${made} }`, value)}`;
}

/** Makes the error that an ErrorInfo of the contract describes. */
function fromInfo(info) {
  const [remedy] = info.remedies ?? [];
  const help = remedy?.value ? `; it may help to call createModel with ${settingOf(remedy)}` : '';
  return new CarillonError(info.reason, inNamesOfCaller(info.message, CALLER_NAMES) + help, info.metadata, info.remedies);
}

/** Waits for a result. A refusal has the caller's names of fields of the contract. */
async function inNames(names, result) {
  try {
    return await result;
  } catch (error) {
    if (!(error instanceof CarillonError) || error instanceof ServerUnavailable) throw error;
    const text = error.message.slice(`${error.reason}: `.length);
    throw new CarillonError(error.reason, inNamesOfCaller(text, names), error.metadata, error.remedies);
  }
}

/** Makes the error of a failed call; its rich status is in the trailing metadata. */
function fromCall(error, server) {
  if (!(error && error.metadata)) return error;
  for (const bytes of error.metadata.get(DETAILS_KEY)) {
    for (const detail of message('StatusDetails').deserialize(bytes).details) {
      if (detail.type_url.endsWith('/carillon.v1.ErrorInfo')) {
        return fromInfo(message('ErrorInfo').deserialize(detail.value));
      }
    }
  }
  if (error.code === grpc.status.UNAVAILABLE) {
    const details = error.details.replace(/\.? Resolution note: $/, '');
    return new ServerUnavailable('SERVER_UNAVAILABLE', `no daemon answers at ${server}: ${details}; start carillond, ` +
      'or give the address where it listens');
  }
  const tooLarge = TOO_LARGE.exec(error.details);
  if (tooLarge) {
    return new CarillonError('MESSAGE_TOO_LARGE', `a message of ${tooLarge[1]} bytes: the daemon takes at most ` +
      `${tooLarge[2]}; report fewer points in a step, or ask for less in one call`);
  }
  return new CarillonError(grpc.status[error.code], error.details);
}

module.exports = { CarillonError, ServerUnavailable, fromCall, fromInfo, inNames };
