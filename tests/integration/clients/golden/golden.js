// SPDX-License-Identifier: Apache-2.0
// The golden scene in JavaScript: writes its trace, renders it, and writes the samples.
// Usage: golden.js SERVER MODEL TRACE SAMPLES
'use strict';

const fs = require('fs');
const carillon = require('carillon');

const STEP_S = 1 / 64;

/** Two bars, one twice as large, the other turned over: struck by wood, resting, sliding, pausing and colliding in slow
 * motion. */
function makeTrace(model) {
  const trace = new carillon.Trace({ step: STEP_S, simulator: 'golden', frame: 'object' });
  trace.add(model, { material: 'chime_aluminum', radiation: 'paper_coupling', label: 'low', size: 2 });
  trace.add(model, { material: 'chime_aluminum', radiation: 'paper_coupling', label: 'high', gain: 0.5,
    pose: { position: [1, 0, 0.5], orientation: [0, 0, 1, 0] } });
  trace.step(0, { impacts: { objects: 1, points: [0, 0.008, 0.02], impulses: [0, 0.125, -0.25], striker: 'wood' } });
  for (let i = 1; i <= 16; i += 1) {
    trace.step(i * STEP_S, { contacts: { objects: [1, 2], points: [[0.125, 0.016, 0], [0.0625, 0, 0.01]],
      impulses: Float32Array.of(0, 0, 0.0625, 0, i / 256, -0.03125), partners: [0, 9], travelSpeeds: [0, 0.5],
      roughnessDepth: 0.25, irregularityLength: 0.001, normals: [[0, 0, 1], [0, 0, 0]] } });
  }
  trace.step(0.25, { timeScale: 0 });
  trace.step(0.5, { timeScale: 0.5, impacts: { objects: 1, points: [0.25, 0, 0.01], impulses: [0, 0.5, 0],
    durations: 0.0009765625, timeOffsets: 0.0078125, secondObjects: 2, secondPoints: [0, 0, 0] } });
  return trace;
}

async function main() {
  const [server, model, traceFile, samplesFile] = process.argv.slice(2);
  const c = carillon.connect(server);
  const trace = makeTrace(model);
  await trace.write(traceFile);
  const { samples } = await c.render(trace, { tailS: 0.5, channelCount: 2 });
  fs.writeFileSync(samplesFile, Buffer.from(samples.buffer, samples.byteOffset, samples.byteLength));
  c.close();
}

main();
