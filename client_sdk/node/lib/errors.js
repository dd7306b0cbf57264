// SPDX-License-Identifier: Apache-2.0
'use strict';

const grpc = require('@grpc/grpc-js');
const { message } = require('./contract');

const DETAILS_KEY = 'grpc-status-details-bin';

/**
 * A refusal. `reason` is stable and one of proto/README.md's; `message` says what was wrong, where, and how to repair
 * it; `metadata` has figures that belong to the reason.
 */
class CarillonError extends Error {
  constructor(reason, text, metadata = {}) {
    super(`${reason}: ${text}`);
    this.name = 'CarillonError';
    this.reason = reason;
    this.metadata = metadata;
  }
}

/** No daemon answers at the address. */
class ServerUnavailable extends CarillonError {}

/** Makes the error that an ErrorInfo of the contract describes. */
function fromInfo(info) {
  return new CarillonError(info.reason, info.message, info.metadata);
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
    return new ServerUnavailable('SERVER_UNAVAILABLE', `no daemon answers at ${server}: ${error.details}; start ` +
      'carillond, or give the address where it listens');
  }
  return new CarillonError(grpc.status[error.code], error.details);
}

module.exports = { CarillonError, ServerUnavailable, fromCall, fromInfo };
