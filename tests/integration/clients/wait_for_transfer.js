// SPDX-License-Identifier: Apache-2.0
// What a model in Node tells before its transfer and after it: node wait_for_transfer.js MODEL FILE, where the daemon
// computes the transfer once FILE is there.
'use strict';

const assert = require('node:assert/strict');
const fs = require('node:fs');
const carillon = require('carillon');

const STRIKE = { point: [0, 0.008, 0.01], impulse: [0, 0, -0.002], duration: 1e-4, seconds: 0.2 };

async function main() {
  const told = [];
  process.on('warning', (warning) => told.push(`${warning.name}: ${warning.message}`));
  const c = carillon.connect();
  const model = await c.model(process.argv[2]);
  const before = await model.renderStrike(STRIKE);
  await new Promise(setImmediate);
  assert.equal(told.length, 1);
  assert.match(told[0], /^TransferWarning: bar \(transfer\) is still being computed/);
  const scene = await c.createScene();
  await scene.add(model, { radiation: 'paper_coupling' });
  await new Promise(setImmediate);
  assert.equal(told.length, 1);
  await scene.addAll([{ model }, { model }]);
  await scene.add(model);
  await new Promise(setImmediate);
  assert.deepEqual(told.slice(1), ["TransferWarning: bar (transfer) is still being computed, so that the objects sound by " +
    "the paper's coupling, at other levels, until they change to it; await waitForTransfer() of the model first"]);
  await assert.rejects(model.waitForTransfer({ timeout: 0.2 }), (error) => error.reason === 'DEADLINE_EXCEEDED'
    && /bar \(transfer\) is running and has not ended after/.test(error.message));
  fs.writeFileSync(process.argv[3], '');
  const labels = [];
  await model.waitForTransfer({ timeout: 60, onProgress: (job) => labels.push(job.label) });
  assert.deepEqual([...new Set(labels)], ['bar (transfer)']);
  assert.equal(model.summary.transfers.length, 1);
  await model.waitForTransfer({ timeout: 0 });
  const after = await model.renderStrike(STRIKE);
  await scene.add(model);
  await new Promise(setImmediate);
  assert.equal(told.length, 2);
  assert.ok(Math.abs(after.peak / before.peak - 1) > 0.1);
  await assert.rejects(model.waitForTransfer({ timeot: 1 }), /did you mean "timeout"/);
  c.close();
}

main().catch((error) => {
  console.error(error);
  process.exitCode = 1;
});
