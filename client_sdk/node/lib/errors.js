// SPDX-License-Identifier: Apache-2.0
'use strict';

const grpc = require('@grpc/grpc-js');
const { message } = require('./contract');

const DETAILS_KEY = 'grpc-status-details-bin';
// How gRPC ends a call whose message has more bytes than the daemon takes.
const TOO_LARGE = /^Received message larger than max \((\d+) vs\.? (\d+)\)/;

/**
 * A refusal. `reason` is stable and one of proto/errors.md's; `message` says what was wrong, where, and how to repair
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

/** Makes the error that an ErrorInfo of the contract describes. */
function fromInfo(info) {
  const [remedy] = info.remedies ?? [];
  const help = remedy?.value ? `; it may help to set ${remedy.field} to ${remedy.value}` : '';
  return new CarillonError(info.reason, info.message + help, info.metadata, info.remedies);
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

module.exports = { CarillonError, ServerUnavailable, fromCall, fromInfo };
