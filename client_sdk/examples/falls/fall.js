// SPDX-License-Identifier: Apache-2.0
'use strict';

// Lets the bodies of a scene (docs/decisions/0042) fall in Rapier or Havok, and records their contacts as the engine
// reports them: node fall.js SCENE TRACE [--engine rapier|havok] [--rate HZ] [--seconds S]
const fs = require('fs');
const { parseArgs } = require('util');
const carillon = require('carillon');

const { values: options, positionals: [scenePath, tracePath] } = parseArgs({ allowPositionals: true, options: {
  engine: { type: 'string', default: 'rapier' }, rate: { type: 'string', default: '240' },
  seconds: { type: 'string' } } });

async function main() {
  const rate = Number(options.rate);
  if (!scenePath || !tracePath || !['rapier', 'havok'].includes(options.engine) || !(rate >= 20)) {
    throw new Error('usage: node fall.js SCENE TRACE [--engine rapier|havok] [--rate HZ] [--seconds S]');
  }
  const scene = JSON.parse(fs.readFileSync(scenePath, 'utf8'));
  const seconds = Number(options.seconds ?? scene.seconds ?? 2);
  if (!(seconds >= 0)) throw new Error(`--seconds ${options.seconds} is no time`);
  const { roughness_depth: depth, irregularity_length_m: irregularity } = scene;
  const settings = depth ? { roughness: { depth, irregularityLengthM: irregularity } } : {};
  const fall = await require(`./${options.engine}_fall`).start(scene, 1 / rate, settings);
  const trace = new carillon.Trace({ frame: 'scene', step: 1 / rate, simulator: `fall.js ${options.engine}` });
  scene.bodies.forEach((body, i) => {
    if (!body.model) return;
    const pose = { position: body.position_m ?? [0, 0, 0], orientation: body.orientation };
    trace.add(body.model, { material: body.material, label: body.name, handle: i + 1, pose });
  });
  for (let step = 1; step <= seconds * rate; step += 1) trace.step(step / rate, fall.step());
  await trace.write(tracePath);
}

main().catch((error) => {
  console.error(`fall.js: ${error.message}`);
  process.exitCode = 1;
});
