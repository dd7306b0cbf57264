// SPDX-License-Identifier: Apache-2.0
'use strict';

const fs = require('fs');
const grpc = require('@grpc/grpc-js');

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

/** The interceptors of a channel whose caller shows `token`; by default that of $CARILLON_TOKEN, if there is one. */
function tokenInterceptors(token = process.env.CARILLON_TOKEN) {
  return token ? [bearer(token)] : [];
}

module.exports = { channelCredentials, tokenInterceptors };
