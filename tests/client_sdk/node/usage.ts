// SPDX-License-Identifier: Apache-2.0
// Every call of the package with its types. It is compiled, and not run.
import * as carillon from 'carillon';

async function main(): Promise<void> {
  const c: carillon.Client = carillon.connect(carillon.defaultServer(), { tlsRoots: 'roots.pem' });
  const version: string = (await c.status()).version;
  const { limits, features } = await c.info();
  const most: number | undefined = limits?.sceneCount;
  const transfers: boolean = features.includes('transfers');
  const mesh = { vertices: new Float64Array(12), triangles: [[0, 1, 2], [0, 2, 3]] };
  const model = await c.createModel(mesh, {
    material: { preset: 'steel', alpha1S: 1e-7 }, size: 2, settings: { poissonRatio: 0.3 }, unit: 'mm', accuracy: 0.01,
    onProgress: (job) => console.log(job.state, job.progress?.fraction),
  });
  const oaken = [await c.createModel(mesh, 'oak'), await c.createModel('part.stl', 'oak', { unit: 'mm' })];
  console.log(oaken.length);
  await model.waitForTransfer({ timeout: 60, onProgress: (job) => console.log(job.label) });
  const scene = await c.createScene({ hearing: { panning: true }, listener: [0, 0, 1] });
  const bell = await scene.add(model, { pose: { position: [0, 0, 0], orientation: [1, 0, 0, 0] }, handle: 3 });
  const shared = await c.createScene({ id: 'lathe-1' });
  const clapper = (await shared.addAll([{ model, handle: 1 }, { model: model.name, gain: 0.5 }]))[1];
  console.log(shared.existing, clapper.handle, (await shared.get()).peak);
  for await (const job of c.jobs({ states: ['failed'] })) console.log(job.label);
  for await (const job of c.watchJobs({ labelContains: 'bell' })) if (job === null) break;
  await bell.strike({ point: [0, 0, 0], impulse: new Float32Array(3), striker: 'wood' });
  await bell.update({ gain: 0.5, glide: 1 });
  const stream = scene.stream({ step: 1 / 240, delay: 0.05, frame: 'scene' });
  await stream.step(0, {
    contacts: { objects: bell, points: new Float32Array(6), impulses: new Float32Array(6), partners: [1, 2] },
    impacts: [{ object: 3, point: [0, 0, 0], impulse: [0, 0, 1], second: { object: bell, point: [0, 0, 0] } }],
    poses: { objects: [3], positions: [[0, 0, 0]] },
  });
  const late: number = (await stream.close(false)).lateCount + stream.lateCount + stream.remapCount;
  const reason: string | undefined = stream.rejection?.reason;
  const far: number | undefined = stream.warnings[0]?.figures.largest_distance_m;
  for await (const found of c.models({ labelContains: 'bell' })) console.log(found.label, found.modeCount);
  const trace = new carillon.Trace({ step: 0.01, pulseShape: 'gaussian' });
  trace.step(0, { contacts: [{ object: trace.add(model), point: [0, 0, 0], impulse: [0, 0, 1], partner: 2 }] });
  const sound: carillon.Sound = await c.render(trace, { tailS: 1 });
  const recorded: Float32Array = (await (await c.listen()).take(1)).samples;
  console.log(version, most, transfers, late, reason, far, sound.summary?.peakPa, recorded.length);
  if (reason === 'IMPULSE_TOO_LARGE') throw new carillon.CarillonError(reason, 'too large', { newton_seconds: '1' });
  c.close();
}

main().catch((error: unknown) => {
  if (error instanceof carillon.ServerUnavailable) console.log(error.reason);
});
