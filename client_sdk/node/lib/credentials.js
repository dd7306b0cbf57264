// SPDX-License-Identifier: Apache-2.0
'use strict';

const fs = require('fs');
const grpc = require('@grpc/grpc-js');
const { isLocal } = require('./address');
const { CarillonError } = require('./errors');

/** Adds the token to every call. */
function bearer(token) {
  return (options, nextCall) => new grpc.InterceptingCall(nextCall(options), {
    start(metadata, listener, next) {
      metadata.set('authorization', `Bearer ${token}`);
      next(metadata, listener);
    },
  });
}

/** The credentials of a channel. Throws a TypeError if the options do not fit together. */
function channelCredentials({ tlsRoots, tlsCertificate, tlsKey }) {
  if (!tlsCertificate !== !tlsKey) throw new TypeError('tlsCertificate and tlsKey belong together; name both files');
  if (tlsCertificate && !tlsRoots) throw new TypeError('a client certificate needs TLS; name the file tlsRoots, too');
  if (!tlsRoots) return grpc.credentials.createInsecure();
  const [roots, key, certificate] = [tlsRoots, tlsKey, tlsCertificate].map((file) => file && fs.readFileSync(file));
  return grpc.credentials.createSsl(roots, key, certificate);
}

/**
 * The options of a channel to `server` whose caller shows `token`; by default that of $CARILLON_TOKEN, if there is one.
 * Throws CarillonError (TLS_REQUIRED) if the token would cross the network in clear.
 */
function channelOptions(server, { token = process.env.CARILLON_TOKEN, tlsRoots }) {
  if (token && !tlsRoots && !isLocal(server)) {
    throw new CarillonError('TLS_REQUIRED', `the token would cross the network to ${server} in clear; give tlsRoots, or ` +
      'the address of a daemon on this machine, or no token');
  }
  return { 'grpc.max_receive_message_length': -1, interceptors: token ? [bearer(token)] : [],
    // A proxy reaches another machine than this one.
    ...(isLocal(server) ? { 'grpc.enable_http_proxy': 0 } : {}) };
}

module.exports = { channelCredentials, channelOptions };
