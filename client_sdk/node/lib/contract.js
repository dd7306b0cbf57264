// SPDX-License-Identifier: Apache-2.0
'use strict';

const fs = require('fs');
const path = require('path');
const grpc = require('@grpc/grpc-js');
const protoLoader = require('@grpc/proto-loader');

// The package brings the contract; in a checkout it is at the top.
const own = path.join(__dirname, '..', 'proto');
const folder = fs.existsSync(own) ? own : path.join(__dirname, '..', '..', '..', 'proto');
const files = fs.readdirSync(path.join(folder, 'carillon/v1')).filter((name) => name.endsWith('.proto'));

// Fields have the names of the contract in camelCase, and 64-bit numbers, which are counts and frames here, are numbers.
const definition = protoLoader.loadSync(files.map((name) => path.join('carillon/v1', name)), {
  includeDirs: [folder], longs: Number, enums: String, defaults: true, oneofs: true,
});

/** The constructors of the services' clients by name. */
const services = grpc.loadPackageDefinition(definition).carillon.v1;

/** A message type of the contract: serialize(object) and deserialize(bytes). */
function message(name) {
  return definition[`carillon.v1.${name}`];
}

module.exports = { message, services };
