// SPDX-License-Identifier: Apache-2.0
// What ingest.cc does, in JavaScript.
// Usage: ingest.js SERVER SCENE rows|columns IMPULSES_A_MESSAGE SECONDS DELAY_S
'use strict';

const carillon = require('carillon');

const OBJECT_COUNT = 16;
const POINT = [0, 0.008, 0.01];
const IMPULSE = [0, 0, -1e-5];
const DURATION_S = 1e-3;
// Steps that may wait before the sender rests; the client would drop them at 4096.
const MOST_WAITING = 256;

function maker(form, count) {
  const handles = Array.from({ length: count }, (_, i) => 1 + (i % OBJECT_COUNT));
  if (form === 'columns') {
    const points = Float32Array.from(handles.flatMap(() => POINT));
    const impulses = Float32Array.from(handles.flatMap(() => IMPULSE));
    return () => ({ impacts: { objects: handles, points, impulses, durations: DURATION_S } });
  }
  return () => ({ impacts: handles.map((object) => (
    { object, point: POINT, impulse: IMPULSE, duration: DURATION_S })) });
}

async function main() {
  const [server, scene, form, count, seconds, delay] = process.argv.slice(2);
  const make = maker(form, Number(count));
  const c = carillon.connect(server);
  const stream = new carillon.Scene(c, scene).stream({ step: 1e-3, delay: Number(delay) });
  const begin = performance.now();
  const elapsed = () => (performance.now() - begin) / 1000;
  const before = process.cpuUsage();
  while (elapsed() < Number(seconds)) {
    // Several steps in a turn of the event loop cost less than one.
    while (stream.waitingStepCount < MOST_WAITING) stream.step(elapsed(), make());
    await new Promise(setImmediate);
  }
  const report = await stream.close();
  const { user, system } = process.cpuUsage(before);
  console.log(JSON.stringify({ seconds: elapsed(), cpu_s: (user + system) / 1e6, accepted: report.acceptedCount,
    late: report.lateCount, dropped: report.droppedCount, rejected: report.rejectedCount,
    steps: report.stepCount }));
  c.close();
}

main();
