// SPDX-License-Identifier: Apache-2.0
'use strict';

// Lets the box of tests/client_sdk/adapters/drops.js fall in an engine, and records its contacts:
// node drop.js ENGINE RATE_HZ SECONDS MODEL TRACE W X Y Z
const carillon = require('carillon');
const { engines, HEIGHT_M } = require('../../client_sdk/adapters/drops');

async function main([engine, rate, seconds, model, path, ...turn]) {
  const orientation = turn.map(Number);
  const fall = await engines[engine](1 / rate, orientation);
  const trace = new carillon.Trace({ frame: 'scene', step: 1 / rate, simulator: `drop.js ${engine}` });
  trace.add(model, { handle: 1, pose: { position: [0, 0, HEIGHT_M], orientation } });
  for (let step = 1; step <= seconds * rate; step += 1) trace.step(step / rate, fall.step());
  await trace.write(path);
  process.exit(); // some engines keep threads
}

main(process.argv.slice(2)).catch((error) => {
  console.error(`drop.js: ${error.stack}`);
  process.exit(1);
});
