// SPDX-License-Identifier: Apache-2.0
'use strict';

const assert = require('node:assert/strict');
const fs = require('node:fs/promises');
const path = require('node:path');
const { spawnSync } = require('node:child_process');
const { after, before, test } = require('node:test');
const carillon = require('carillon');

const POINT = [0, 0.008, 0.01];
const IMPULSE = [0, 0, -0.002];
const STRIKE = { point: POINT, impulse: IMPULSE, duration: 1e-4 };
const FOLDER = path.dirname(process.env.CARILLON_TEST_BAR);
const BAR = process.env.CARILLON_TEST_BAR;
const material = process.env.CARILLON_TEST_MATERIAL;

let c;
let model;

before(async () => {
  c = carillon.connect();
  model = await c.createModel(BAR, { material });
});

after(() => c.close());

async function warningsOf(use) {
  const told = [];
  const listener = (warning) => told.push(`${warning.name}: ${warning.message}`);
  process.on('warning', listener);
  await use();
  await new Promise(setImmediate);
  process.off('warning', listener);
  return told;
}

async function withScene(use) {
  const scene = await c.createScene();
  try {
    return await use(scene);
  } finally {
    await scene.delete();
  }
}

test('the progress of a model is told, it has its unit, and it is found by a part of its label', async () => {
  const states = [];
  const large = await c.createModel(BAR, { material, unit: 1.5, label: 'large', onProgress: (job) => states.push(job.state) });
  assert.equal(states.at(-1), 'JOB_STATE_SUCCEEDED');
  assert.ok(Math.abs(large.summary.header.volumeM3 / model.summary.header.volumeM3 / 1.5 ** 3 - 1) < 1e-6);
  const found = [];
  for await (const one of c.models({ labelContains: 'arg' })) found.push(one.name);
  assert.deepEqual(found, [large.name]);
});

test('mistakes with models and files are told, and a model is found by its label and by the first digits of its digest', async () => {
  for (const text of [model.label, model.name.slice('modalModels/'.length, -50)]) {
    assert.equal((await c.model(text)).name, model.name);
  }
  const misspelt = `${model.label.slice(0, -1)}z`;
  await assert.rejects(c.model(misspelt), { reason: 'MODAL_MODEL_NOT_FOUND',
    message: new RegExp(`'${misspelt}'.*did you mean '${model.label}'\\?`) });
  assert.match((await warningsOf(() => c.createModel(BAR, { material, label: 'beam' }))).join(),
    /LabelWarning: .*keeps this label, so that 'beam' does not name it/);
  assert.deepEqual(await warningsOf(() => c.createModel(BAR, { material, label: model.label })), []);
  const trace = new carillon.Trace();
  trace.add(model);
  await withScene(async (scene) => {
    const bar = await scene.add(model);
    assert.throws(() => trace.step(0, { impacts: [{ object: bar, ...STRIKE }] }), /which is not in the trace/);
  });
  await assert.rejects(new carillon.Sound(new Float32Array(1), 48000, 1).save('x.mp3'), /must end with .wav/);
  assert.throws(() => carillon.connect('/run/carillond.sock'), /"unix:PATH" or "HOST:PORT"/);
  await assert.rejects(c.model(5), /^TypeError: the model is 5; it must be its label/);
});

test('a glTF brings the file with its data', async () => {
  const file = process.env.CARILLON_TEST_GLTF;
  assert.equal((await c.createModel(file, { material })).modeCount, model.modeCount);
  const outside = path.join(FOLDER, 'outside.gltf');
  await fs.writeFile(outside, (await fs.readFile(file, 'utf8')).replace('box.bin', '%2e%2e/box.bin'));
  await assert.rejects(c.createModel(outside, { material }), { reason: 'MESH_UNREADABLE' });
});

test('the daemon says what it is', async () => {
  const info = await c.info();
  assert.equal(info.version, require('carillon/package.json').version);
  assert.equal(info.limits.sceneCount, 512);
  assert.ok(info.features.includes('decomposition'));
  assert.ok(info.uptimeS > 0);
});

test('a rendered strike is the same again, and is saved', async () => {
  const once = await model.renderStrike({ ...STRIKE, seconds: 1 });
  const again = await model.renderStrike({ ...STRIKE, seconds: 1 });
  assert.ok(once.peak > 1e-4);
  assert.deepEqual(again.samples, once.samples);
  const file = path.join(FOLDER, 'node.wav');
  await once.save(file);
  assert.equal((await fs.stat(file)).size, 44 + 3 * once.samples.length);
});

test('a scene with two ears warns if the daemon plays one channel', async () => {
  const told = await warningsOf(async () => {
    for (const hearing of [{ panning: true }, { distanceGain: true }]) await (await c.createScene({ hearing })).delete();
  });
  assert.equal(told.length, 1);
  assert.match(told[0], /^HearingWarning: scenes\/\d+ has panning or two ears, but the daemon plays one channel, .*--channels 2`$/);
});

test('a scene with an id is found again with its objects', async () => {
  const made = await c.createScene({ id: 'lathe-1' });
  try {
    assert.deepEqual([made.name, made.existing], ['scenes/lathe-1', false]);
    await made.addAll([{ model }, { model, handle: 7, gain: 2 }]);
    await assert.rejects(made.addAll([{ model }, { model, handle: 7 }]),
      (error) => error.reason === 'OBJECT_EXISTS' && error.metadata.index === '1');
    const again = await c.createScene({ id: 'lathe-1' });
    assert.equal(again.existing, true);
    assert.deepEqual((await again.objects()).map((object) => object.handle), [1, 7]);
    assert.equal((await again.get()).objectCount, 2);
    await assert.rejects(c.createScene({ id: 'lathe-1', gain: 2 }), { reason: 'SCENE_DIFFERS' });
  } finally {
    await made.delete();
  }
});

test('jobs are watched and listed by state and label', async () => {
  for await (const job of c.watchJobs({ states: ['queued'] })) {
    assert.equal(job, null);
    break;
  }
  const labels = [];
  for await (const job of c.jobs({ states: ['succeeded'], labelContains: model.label })) labels.push(job.label);
  assert.ok(labels.includes(model.label));
  for await (const job of c.jobs({ states: ['cancelled'] })) assert.fail(job.name);
});

test('contacts in rows sound as the same in columns', async () => {
  // Numbers that a float holds exactly, because columns are floats.
  const blow = IMPULSE.map((x) => 10 * x); // far above the weight of the bar
  const [point, impulse] = [POINT, blow].map((values) => Array.from(Float32Array.from(values)));
  const rows = [{ object: 1, point, impulse, partner: 7 }];
  const columns = { objects: 1, points: Float32Array.from(POINT), impulses: [blow], partners: [7] };
  const [one, other] = await Promise.all([rows, columns].map((contacts) => {
    const trace = new carillon.Trace({ step: 1 / 240 });
    trace.add(model);
    for (const i of [0, 1, 2]) trace.step(i / 240, { contacts });
    return c.render(trace, { tailS: 0.3 });
  }));
  assert.ok(one.peak > 1e-5);
  assert.deepEqual(one.samples, other.samples);
});

test('a stream counts, and tells what was wrong', async () => {
  await withScene(async (scene) => {
    const bars = [await scene.add(model), await scene.add(model)];
    const stream = scene.stream({ step: 1 / 240 });
    for (let i = 0; i < 48; i += 1) {
      await stream.step(i / 240, {
        contacts: { objects: bars, points: [POINT, POINT], impulses: [IMPULSE, IMPULSE], partners: [1, 2] },
        poses: { objects: bars, positions: [[i, 0, 0], [i, 1, 0]] },
      });
    }
    await stream.step(0.2, { impacts: [{ object: bars[0], point: POINT, impulse: [0, 0, -1e9] }] });
    await stream.step(0.2, { impacts: [{ object: bars[0], point: [0, 0, 1], impulse: IMPULSE }] });
    const report = await stream.close();
    assert.equal(report.stepCount, 50);
    assert.equal(report.rejectedCount, 1);
    assert.equal(stream.rejection.reason, 'IMPULSE_TOO_LARGE');
    assert.equal(stream.warnings.find(({ id }) => id === 'POINTS_DISTANT').count, 1);
    assert.ok(stream.findings.loadCount > 0);
    assert.deepEqual((await scene.objects()).map((bar) => bar.handle), bars.map((bar) => bar.handle));
  });
});

test('a material and settings that the daemon told may be given back', async () => {
  const found = await c.model(model.name);
  assert.ok('_poissonRatio' in found.material);
  const again = await c.createModel(BAR, { material: found.material, settings: found.summary.header.settings });
  assert.equal(again.modeCount, model.modeCount);
  await withScene(async (scene) => assert.equal((await scene.add(found)).handle, 1));
});

test('a material by region reaches the mesh', async () => {
  const refused = c.createModel(BAR, { material: { regions: { head: material, '': 'oak' } } });
  await assert.rejects(refused, { reason: 'MESH_REGION_UNKNOWN' });
});

test('contacts that come late are told once', async () => withScene(async (scene) => {
  await scene.add(model, { handle: 1 });
  const stream = scene.stream({ step: 1 / 240, delay: 0 });
  const told = await warningsOf(async () => {
    await stream.step(0);
    await (await c.listen()).take(0.1);
    await stream.step(0, { impacts: [{ object: 1, ...STRIKE }] });
    await stream.close();
  });
  assert.deepEqual(told.map((line) => line.split(': ')[1]), ['CONTACTS_LATE']);
  assert.deepEqual(stream.warnings.map(({ count, figures }) => [count, figures]), [[1, { scheduling_delay_s: 0 }]]);
  assert.deepEqual([stream.lateCount, stream.remapCount], [1, 0]);
}));

test('refusals have the reason of the contract', async () => {
  const open = { vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], triangles: [[0, 1, 2]] };
  await assert.rejects(c.createModel(open, { material }), { reason: 'MESH_NOT_CLOSED' });
  await assert.rejects(c.createModel(BAR, { material: 'chime_aluminium' }), { reason: 'UNKNOWN_MATERIAL' });
  await assert.rejects(model.renderStrike({ ...STRIKE, duration: undefined, striker: 'marshmallow' }),
    { reason: 'UNKNOWN_STRIKER' });
  await withScene(async (scene) => {
    const bar = await scene.add(model);
    await assert.rejects(bar.strike({ point: POINT, impulse: [0, 0, NaN] }), { reason: 'CONTACT_MALFORMED' });
  });
  const gone = await c.createScene();
  await gone.delete();
  await assert.rejects(gone.stream({ step: 0.01 }).close(), { reason: 'SCENE_NOT_FOUND' });
  await assert.rejects(carillon.connect(`unix:${FOLDER}/nobody`).status(), carillon.ServerUnavailable);
});

test('a stream that was closed refuses further steps', async () => withScene(async (scene) => {
  const stream = scene.stream({ step: 0.01 });
  await stream.close();
  assert.throws(() => stream.step(1), (error) => error.reason === 'CONTACT_STREAM_ENDED'
    && error.message.includes('open another one'));
}));

test('more renderings than a client may have wait', async () => {
  const sounds = await Promise.all(Array.from({ length: 16 }, () => model.renderStrike({ ...STRIKE, seconds: 0.1 })));
  assert.equal(new Set(sounds.map((sound) => sound.peak)).size, 1);
});

test('a performance gives the samples of each step, the same again after a reset, and refuses unknown objects', async () => {
  const sound = await c.perform({ step: 0.02, environments: 2, microphones: [{ pose: [0, 0, 1.5] }, { kind: 'stereo' }],
    tellImpacts: true });
  assert.deepEqual([sound.channelCount, sound.sampleRateHz, sound.latency], [3, 48000, 0]);
  const bar = sound.add(model);
  const blow = { objects: bar, points: [POINT], impulses: [IMPULSE], durations: 1e-4, environments: [1] };
  const episodes = [];
  for (let episode = 0; episode < 2; episode += 1) {
    const silence = await sound.step({ impacts: blow });
    assert.equal(silence.frameCount, 960);
    assert.equal(silence.samples.length, 2 * 3 * 960);
    assert.ok(silence.samples.every((sample) => sample === 0));
    assert.deepEqual([silence.impacts.environment, silence.impacts.object], [[1], [bar]]);
    const { samples } = await sound.step();
    assert.ok(samples.subarray(0, 3 * 960).every((sample) => sample === 0));
    assert.ok(samples.subarray(3 * 960).some((sample) => Math.abs(sample) > 1e-3));
    episodes.push(samples);
    sound.reset();
  }
  assert.deepEqual(episodes[0], episodes[1]);
  await assert.rejects(sound.step({ impacts: { ...blow, objects: 9 } }),
    ({ reason, performed }) => reason === 'OBJECT_NOT_FOUND' && performed.samples.length === 2 * 3 * 960);
  await assert.rejects(sound.step({ impacts: { ...blow, environments: [2] } }), { reason: 'PERFORMANCE_MALFORMED' });
  // One index is that of all rows, and a list has one for each row: what the client refuses loses nothing.
  const two = { ...blow, points: [POINT, POINT], impulses: [IMPULSE, IMPULSE] };
  const gong = sound.add(model);
  for (const environments of [[1], [0, 1, 1], [true, false], 0.5]) {
    await assert.rejects(sound.step({ impacts: { ...two, environments } }), (error) => !error.performed);
  }
  const { impacts } = await sound.step({ impacts: { ...two, objects: gong, environments: 1 } });
  assert.deepEqual(impacts.environment, [1, 1]);
  sound.remove(9, [1]);
  await assert.rejects(sound.step({ impacts: blow }), ({ reason, metadata, performed }) =>
    reason === 'OBJECT_NOT_FOUND' && metadata.environment === '1' && performed.impacts.object.length === 1);
  await assert.rejects(c.perform({ step: 0.02, latency: 1 }), { reason: 'INVALID_SETTINGS' });
  const slow = await c.perform({ step: 0.02 });
  const counts = [];
  for (const timeScale of [1, 0.25, 0, 4]) counts.push((await slow.step({ timeScale })).frameCount);
  assert.deepEqual(counts, [960, 3840, 960, 240]);
  await assert.rejects(slow.step({ timeScale: -1 }), TypeError);
  assert.throws(() => slow.reset([1]), { reason: 'PERFORMANCE_MALFORMED' });
  const far = { ...blow, objects: slow.add(model), points: [[9, 9, 9]], environments: [0] };
  await slow.step({ impacts: far });
  assert.deepEqual((await slow.close()).map(({ id, count }) => [id, count]), [['POINTS_DISTANT', 1]]);
  assert.deepEqual(slow.warnings.map(({ id }) => id), ['POINTS_DISTANT']);
  await assert.rejects(slow.step(), { reason: 'CONTACT_STREAM_ENDED' });
  assert.deepEqual(await sound.close(), []);
});

test('a trace is written and read, and a damaged one is refused', async () => {
  const trace = new carillon.Trace({ step: 1 / 60, simulator: 'test' });
  trace.add(model);
  trace.step(0, { impacts: [{ object: 1, ...STRIKE }] });
  const file = path.join(FOLDER, 'node.contacts');
  await trace.write(file);
  const [one, other] = [await c.render(trace, { tailS: 0.2 }), await c.render(file, { tailS: 0.2 })];
  assert.ok(one.peak > 1e-4);
  assert.deepEqual(one.samples, other.samples);
  const header = [4, 0x0a, 2, 8, 1];
  for (const [bytes, reason] of [[trace.bytes().subarray(0, -3), 'TRACE_MALFORMED'], [[], 'TRACE_MALFORMED'],
    [[4, 0x0a, 2, 8, 9], 'TRACE_TOO_NEW'], [[2, 0x0a, 0], 'TRACE_MALFORMED'],
    [[...header, 3, 0x7a, 1, 0], 'TRACE_MALFORMED'], [Array(100).fill(0xff), 'TRACE_MALFORMED']]) {
    await fs.writeFile(file, Buffer.from(bytes));
    await assert.rejects(carillon.Trace.read(file), { reason });
  }
  assert.throws(() => trace.step(1, { contacts: { objects: 1, points: [0, 0], impulses: [0, 0] } }), /3 a contact/);
});

test('a scene is turned down, muted and stopped', async () => {
  const scene = await c.createScene({ gain: 0.5 });
  try {
    assert.equal((await scene.update({ muted: true })).gain, 0.5);
    const bar = await scene.add(model);
    const muted = await scene.listen({ blockFrameCount: 4800 });
    await bar.strike(STRIKE);
    assert.equal((await muted.take(0.5)).peak, 0);
    await scene.update({ muted: false });
    const heard = await scene.listen({ encoding: 'AUDIO_ENCODING_INT16' });
    assert.ok((await heard.take(0.3)).peak > 0);
    await scene.stop();
    assert.ok(await c.stopAll() >= 1);
  } finally {
    await scene.delete();
  }
  assert.equal((await c.setVolume({ gain: 0.25 })).gain, 0.25);
  await c.setVolume({ gain: 1 });
});

test('a process ends though its streams and recordings are open', () => {
  const script = `const carillon = require('carillon');
    (async () => {
      const c = carillon.connect();
      try {
        const record = await c.listen();
        const scene = await c.createScene();
        const stream = scene.stream({ step: 1 / 60 });
        for (let i = 0; i < 5000; i += 1) stream.step(i / 60, {});
        await new Promise((resolve) => setTimeout(resolve, 200));
        throw new Error('a bug');
      } finally {
        c.close();
      }
    })().catch((error) => console.log(error.message));`;
  const done = spawnSync(process.execPath, ['-e', script], { encoding: 'utf8', timeout: 30000 });
  assert.deepEqual([done.status, done.stdout], [0, 'a bug\n']);
  assert.match(done.stderr, /ContactWarning: STREAM_NOT_CLOSED: a stream of scenes\/\S+ was/);
  assert.match(done.stderr, /ContactWarning: STEPS_DROPPED: \d+ steps not sent, .* await stream\.step/);
});

test('a forgotten await and numbers that make no rows are refused', async () => withScene(async (scene) => {
  for (const wrong of [undefined, c.model('bar')]) {
    await assert.rejects(async () => scene.add(wrong), /the model is .*; it must be a Model, such as await createModel/);
  }
  for (const [vertices, triangles] of [[new Float64Array(11), [0, 1, 2]], [new Float64Array(9), [0, 1, 2, 0]]]) {
    await assert.rejects(c.createModel({ vertices, triangles }, { material }), /has (11|4) numbers; it must have three/);
  }
  const other = carillon.connect();
  other.close();
  await assert.rejects(async () => other.info(), /has been closed; connect again/);
}));

test('a stream that is being closed ends though its client is closed', async () => {
  const own = carillon.connect();
  const scene = await c.createScene();
  const bar = await scene.add(model);
  const stream = new carillon.Scene(own, scene.name).stream({ step: 1 / 60 });
  await stream.step(0, { impacts: [{ object: bar.handle, ...STRIKE }] });
  const closed = stream.close();
  own.close();
  assert.equal(Number((await closed).stepCount), 1);
  await scene.delete();
});

test('takes follow each other without a gap, and then blocks', async () => withScene(async (scene) => {
  const bar = await scene.add(model);
  const [whole, pieces] = [await scene.listen(), await scene.listen()];
  for (const seconds of [NaN, undefined, 0, -1]) {
    await assert.rejects(pieces.take(seconds), /seconds is \S+; it must be a number above 0/);
  }
  await bar.strike(STRIKE);
  const joined = [...(await pieces.take(0.3)).samples, ...(await pieces.take(0.001)).samples];
  for await (const block of pieces) {
    joined.push(...block.samples);
    if (joined.length > 24000) break;
  }
  const atOnce = (await whole.take(1)).samples;
  await whole.stop();
  // The two recordings may begin at different blocks.
  const [first, other] = [joined, atOnce].map((samples) => samples.findIndex((x) => Math.abs(x) > 1e-3));
  assert.ok(first >= 0 && other >= 0);
  assert.deepEqual(joined.slice(first), [...atOnce.slice(other, other + joined.length - first)]);
}));

test('a take that waits ends with its recording', async () => {
  const record = await c.listen();
  const waiting = assert.rejects(record.take(3600), { reason: 'CANCELLED' });
  await record.stop();
  await waiting;
});

test('a method with streams is not called as one without', () => {
  assert.throws(() => c.call('AudioService', 'Listen', {}), /AudioService.Listen has a stream .* use listen/);
  assert.throws(() => c.call('AudioService', 'Lisen', {}), /'AudioService.Lisen'; it must be a method/);
});

test('a stream that is too fast drops the oldest steps', async () => withScene(async (scene) => {
  const stream = scene.stream({ step: 0.001 });
  const write = stream.call.write.bind(stream.call);
  let messageCount = 0;
  stream.call.write = (...request) => {
    messageCount += 1;
    return write(...request);
  };
  // Nothing is sent while this loop does not wait.
  for (let i = 0; i < 5000; i += 1) stream.step(0.001 * i, {});
  assert.ok(stream.droppedStepCount > 5000 - 4096 - 100);
  const report = await stream.close();
  assert.equal(Number(report.stepCount) + stream.droppedStepCount, 5000);
  assert.ok(messageCount < 100, `the steps that waited were sent in ${messageCount} messages`);
  assert.equal(stream.waitingStepCount, 0);
}));
