// SPDX-License-Identifier: Apache-2.0
// What the package tells its callers without a daemon: warnings, refusals in their own names, and short forms.
'use strict';

const assert = require('node:assert/strict');
const fs = require('node:fs');
const os = require('node:os');
const path = require('node:path');
const { test } = require('node:test');
const { inspect } = require('node:util');
const carillon = require('carillon');
const { Metadata } = require('@grpc/grpc-js');
const { fromCall, fromInfo } = require('carillon/lib/errors');
const { toMeshFile } = require('carillon/lib/meshes');
const { stateOf } = require('carillon/lib/progress');
const { toSettings } = require('carillon/lib/settings');
const { warnOfContacts, warnOfLabel } = require('carillon/lib/warnings');

const POINT = [0, 0, 0];
const IMPULSE = [0, 0, 1];
const c = carillon.connect('unix:/nowhere');
const scene = new carillon.Scene(c, 'scenes/1');
const MESSAGE = { handle: 3, soundingModeCount: 1, lowestFrequencyHz: 440, highestFrequencyHz: 440 };
const bell = new carillon.SoundingObject(scene, MESSAGE);
const mesh = { vertices: [POINT], triangles: [[0, 0, 0]] };
const MODEL = 'modalModels/1';
const row = { object: 1, point: POINT, impulse: IMPULSE };
const columns = { objects: 1, points: POINT, impulses: IMPULSE };
const create = (...words) => () => c.createModel(mesh, ...words);

/** The warnings of the process that a function makes. */
async function warningsOf(function_) {
  const told = [];
  const listener = (warning) => told.push(`${[warning.name, warning.code].join(' ').trim()}: ${warning.message}`);
  process.on('warning', listener);
  function_();
  await new Promise(setImmediate);
  process.off('warning', listener);
  return told;
}

/** A stream whose steps all wait, as if the network took none. */
function stoppedStream() {
  const stream = scene.stream({ step: 1 / 240 });
  stream.isFull = true;
  return stream;
}

/** Each of the calls must be refused with an error of a kind that has the words. */
async function refuse(kind, ...rows) {
  for (const [words, call] of rows) {
    await assert.rejects(async () => call(), (error) => (error instanceof kind && error.message.includes(words))
      || assert.fail(`${error} is no ${kind.name} with ${words}`));
  }
}

/** Takes a step into a new trace. */
const step = (content) => () => new carillon.Trace({ step: 1 / 240 }).step(0, content);

test('a token crosses no network in clear', () => {
  for (const server of ['10.0.0.2:50051', 'dns:///example.org:1', '127.example.org:1', '[2001:db8::1]:1', 'ipv4:10.0.0.2:1']) {
    assert.throws(() => carillon.connect(server, { token: 'secret' }), { reason: 'TLS_REQUIRED' });
    carillon.connect(server).close();
  }
  for (const server of ['unix:/nowhere', 'unix-abstract:carillon', 'localhost:1', '127.0.0.2:1', '[::1]:1', 'ipv4:127.0.0.1:1',
    'ipv6:[::1]:1', 'dns:///localhost:1']) {
    carillon.connect(server, { token: 'secret' }).close();
  }
});

test('warnings of the daemon are told by their ids, and steps that were not sent by the client', async () => {
  assert.deepEqual(await warningsOf(() => warnOfContacts([{ id: 'TIME_STANDS', count: 10, figures: {}, text: 'a sentence' }])),
    ['ContactWarning TIME_STANDS: TIME_STANDS: a sentence']);
  const stream = stoppedStream();
  assert.deepEqual(stream.warnings, []);
  stream.report = { warnings: [{ id: 'TIME_STANDS' }] };
  stream.droppedStepCount = 1;
  assert.deepEqual(stream.warnings.map(({ id, count }) => [id, count]), [['TIME_STANDS', undefined], ['STEPS_DROPPED', 1]]);
});

test('an object of another scene is refused', async () => {
  const stream = new carillon.Scene(c, 'scenes/2').stream({ step: 1 / 240 });
  for (const impacts of [[{ object: bell, point: POINT, impulse: IMPULSE }],
    { objects: [1, bell], points: [0, 0, 0, 0, 0, 0], impulses: [0, 0, 1, 0, 0, 1] }]) {
    assert.throws(() => stream.step(0, { impacts }), /object of scenes\/1, and this is a stream of scenes\/2/);
  }
  await assert.rejects(stream.close(), carillon.ServerUnavailable);
});

test('one place has the same coordinates for both objects in the frame of the scene alone', async () => {
  const place = [1, 2, 3];
  const both = { ...columns, points: place, secondObjects: 2 };
  const pair = { ...row, point: place, second: { object: 2 } };
  await refuse(Error, ['secondPoints is undefined; it must be numbers, 3 a contact: metres', step({ contacts: both })],
    ['point of second of contacts[0] is undefined', step({ contacts: [pair] })]);
  const trace = new carillon.Trace({ step: 1 / 240, frame: 'scene' });
  trace.step(0, { contacts: both });
  trace.step(0, { contacts: [pair] });
  assert.deepEqual(trace.steps[0].contactColumns[0].secondPointM, place);
  assert.deepEqual(trace.steps[1].contacts[0].second.pointM, { x: 1, y: 2, z: 3 });
});

test('a key that is misspelt or at the wrong level is refused with the right one', async () => {
  const misspelt = (wrong, right, call) => [`no "${wrong}"; did you mean "${right}"?`, call];
  await refuse(Error,
    misspelt('max_frequency', 'maxFrequencyHz', create({ material: 'oak', max_frequency: 1 })),
    misspelt('young', 'youngPa', create({ material: { young: 1 } })),
    misspelt('meters_per_unit', 'metresPerUnit', create({ material: 'oak', settings: { meters_per_unit: 1 } })),
    misspelt('unti', 'unit', create('oak', { unti: 'mm' })),
    misspelt('accuracys', 'accuracy', create({ material: 'oak', accuracys: 0.1 })),
    misspelt('tail', 'tailS', () => c.render(new carillon.Trace(), { tail: 1 })),
    misspelt('scen', 'scene', () => c.listen({ scen: 'x' })),
    misspelt('listner', 'listener', () => c.createScene({ listner: POINT })),
    misspelt('gian', 'gain', () => scene.add(MODEL, { gian: 1 })),
    misspelt('gian', 'gain', () => scene.addAll([{ model: MODEL, gian: 1 }])),
    misspelt('impuls', 'impulse', () => bell.strike({ point: POINT, impuls: IMPULSE })),
    misspelt('stp', 'step', () => new carillon.Trace({ stp: 1 })),
    misspelt('stepp', 'step', () => scene.stream({ stepp: 1 })),
    misspelt('tlsRoot', 'tlsRoots', () => carillon.connect('unix:/x', { tlsRoot: 'x' })),
    misspelt('impluse', 'impulse', step({ contacts: [{ object: 1, point: POINT, impluse: IMPULSE }] })),
    misspelt('point', 'points', step({ contacts: { objects: 1, point: POINT } })),
    misspelt('contact', 'contacts', step({ contact: [] })),
    ['no "poissonRatio"; give it as settings: { poissonRatio: ... } or material: { poissonRatio: ... }',
      create({ material: 'oak', poissonRatio: 1 })],
    ['no "budgetS"; give it as settings: { mesh: { budgetS: ... } } or transfer: { budgetS: ... }',
      create({ material: 'oak', budgetS: 1 })],
    ['"panning"; give it as hearing: { panning: ... }', () => c.createScene({ panning: true })]);
});

test('the unit and the accuracy become settings', () => {
  const made = toSettings({ poissonRatio: 0.3 }, 'mm', 0.01);
  assert.deepEqual(made, { poissonRatio: 0.3, metresPerUnit: 0.001, mesh: { accuracy: 0.01 } });
  assert.deepEqual(toSettings(undefined, 2), { metresPerUnit: 2 });
});

test('a wrong value is refused by its name', async () => {
  await refuse(Error,
    ["unit is 'km'", create({ material: 'oak', unit: 'km' })], ['unit is 0', create({ material: 'oak', unit: 0 })],
    ['accuracy is 1;', create({ material: 'oak', accuracy: 1 })],
    ['unit and settings.metresPerUnit', create({ material: 'oak', unit: 'mm', settings: { metresPerUnit: 1 } })],
    ["frame is 'world'; it must be one of \"object\", \"scene\"", () => new carillon.Trace({ frame: 'world' })],
    ['"raised_cosine", "gaussian"', () => new carillon.Trace({ pulseShape: 'box' })],
    ['"modes_only"', () => new carillon.Trace().add(MODEL, { radiation: 'none' })],
    ["an entry of states is 'broken'", () => c.jobs({ states: ['broken'] }).next()],
    ["tailS of render is 'long'", () => c.render(new carillon.Trace(), { tailS: 'long' })],
    ["encoding of listen is 'int16'", () => c.listen({ encoding: 'int16' })],
    ['material is undefined', create()],
    ['two materials', create('oak', { material: 'oak' })], ['two materials', create({ material: 'oak' }, { size: 2 })],
    ['createModel is given 5', create(5)], ['createModel is given 2', create('oak', 2)],
    ['createModel is given null', create(null)], ["add is given 'oak'", () => scene.add(MODEL, 'oak')],
    ["add is given 'oak'", () => new carillon.Trace().add(MODEL, 'oak')],
    ["update is given 'louder'", () => bell.update('louder')], ['impacts[0] is given 7', step({ impacts: [7] })]);
  await refuse(TypeError, ...[5, null, {}, { vertices: [[0, 0, 0]] }].map((wrong) => ['the mesh is ',
    () => c.createModel(wrong, { material: 'oak' })]),
  ...['', 'modalModels/', 3].map((wrong) => [`the model is ${inspect(wrong)}`, () => c.model(wrong)]),
  ["the model is ''", () => scene.add('')], ["the model is ''", () => new carillon.Trace().add('')]);
});

test('the name of a material may come alone or before the rest of a request', async () => {
  for (const words of [['oak'], ['oak', { size: 2 }], [{ material: 'oak', size: 2 }]]) {
    await assert.rejects(create(...words), carillon.ServerUnavailable);
  }
});

test('contacts are refused by their names, with unit and frame', async () => {
  const own = "in the stream's frame";
  await refuse(Error,
    [`point of contacts[1] is [ 0, 0 ]; it must be [x, y, z]: metres ${own}`,
      step({ contacts: [row, { ...row, point: [0, 0] }] })],
    [`impulse of impacts[0] is undefined; it must be [x, y, z]: newton seconds ${own}`,
      step({ impacts: [{ object: 1, point: POINT }] })],
    ['object of contacts[0] is undefined', step({ contacts: [{ point: POINT, impulse: IMPULSE }] })],
    [`points has 2 numbers; it must have 3 a contact: metres ${own}`,
      step({ contacts: { ...columns, points: [0, 0] } })],
    ['points is undefined', step({ contacts: { objects: 1, impulses: IMPULSE } })],
    ['points has the numbers of 1 contact and impulses has those of 2',
      step({ contacts: { ...columns, impulses: [IMPULSE, IMPULSE] } })],
    ["listener is [ 1, 2 ]; it must be [x, y, z]: metres in the scene's frame", step({ listener: [1, 2] })],
    ["point is [ 0, 0 ]; it must be [x, y, z]: metres in the object's own frame",
      () => bell.strike({ point: [0, 0], impulse: IMPULSE })],
    ['impulse is [ 0, 0, 0 ]', () => bell.strike({ point: POINT, impulse: [0, 0, 0] })]);
  step({ impacts: { ...columns, impulses: [0, 0, 0] } })(); // a strike would be silent
});

test('handles and partners that are no whole numbers of 32 bits are refused', async () => {
  for (const wrong of ['floor', '5', 1.7, -1, 1 + 2 ** 32, NaN]) {
    const shown = `is ${inspect(wrong)};`;
    await refuse(Error,
      [`object of impacts[0] ${shown}`, step({ impacts: [{ ...row, object: wrong }] })],
      [`partner of contacts[0] ${shown}`, step({ contacts: [{ ...row, partner: wrong }] })],
      [`an entry of objects ${shown}`, step({ impacts: { ...columns, objects: [wrong] } })],
      [`an entry of partners ${shown}`, step({ contacts: { ...columns, partners: wrong } })],
      [`an entry of partners ${shown}`, step({ contacts: { ...columns, partners: [wrong] } })],
      ['handle of add is ', () => new carillon.Trace().add(MODEL, { handle: wrong })]);
  }
});

test('a negative duration is refused, and an undefined one is left to the daemon', async () => {
  await refuse(Error,
    ['an entry of durations is -5', step({ impacts: { ...columns, durations: -5 } })],
    ['duration of impacts[0] is -5', step({ impacts: [{ ...row, duration: -5 }] })],
    ['duration is -5', () => bell.strike({ point: POINT, impulse: IMPULSE, duration: -5 })]);
  const trace = new carillon.Trace();
  trace.step(0, { impacts: { ...columns, durations: NaN } });
  trace.step(0, { impacts: [{ ...row, duration: NaN }] });
  assert.deepEqual(trace.steps[0].contactColumns[0].durationS, [-1]);
  assert.equal('durationS' in trace.steps[1].contacts[0], false);
});

test('text in place of a number is refused with the name of the field', async () => {
  const text = '0.5';
  const trace = new carillon.Trace({ step: 1 / 240 });
  await refuse(TypeError, ...[
    ['gain of add', () => scene.add(MODEL, { gain: text })],
    ['size of object 0 of addAll', () => scene.addAll([{ model: MODEL, size: text }])],
    ['gain of add', () => trace.add(MODEL, { gain: text })],
    ['gain of update', () => bell.update({ gain: text })], ['glide of update', () => bell.update({ glide: text })],
    ['gain of update', () => scene.update({ gain: text })], ['gain of setVolume', () => c.setVolume({ gain: text })],
    ['gain of createScene', () => c.createScene({ gain: text })],
    ['glide of moveListener', () => scene.moveListener(POINT, text)],
    ['step of stream', () => scene.stream({ step: text })],
    ['delay of stream', () => scene.stream({ step: 0.01, delay: text })],
    ['step of Trace', () => new carillon.Trace({ step: text })],
    ['timeOffset of impacts[0]', () => trace.step(0, { impacts: [{ ...row, timeOffset: text }] })],
    ['roughnessDepth of contacts', () => trace.step(0, { contacts: { ...columns, roughnessDepth: text } })],
    ['seconds of renderStrike', () => new carillon.Model(c, { name: MODEL }).renderStrike({ point: POINT,
      impulse: IMPULSE, seconds: text })],
  ].map(([name, call]) => [`${name} is '0.5'; it must be a number`, call]));
  assert.equal(trace.objects.length + trace.steps.length, 0);
});

test('a trace of contacts needs the length of its steps, as a stream does', () => {
  assert.throws(() => new carillon.Trace().step(0, { contacts: [row] }), /new Trace\(\{ step: 1 \/ 240 \}\)/);
  new carillon.Trace().step(0, { impacts: [row] });
  step({ contacts: [row] })();
});

test('a step whose time is too large or goes back is refused at once, and the trace or the stream can go on', async () => {
  const [trace, stream] = [new carillon.Trace(), stoppedStream()];
  for (const target of [trace, stream]) {
    for (const time of [NaN, Infinity, -1.1e10]) {
      assert.throws(() => target.step(time), { name: 'CarillonError', reason: 'INVALID_STREAM' });
    }
    for (const time of [-1, 2, 2]) target.step(time);
    assert.throws(() => target.step(1.5), { reason: 'INVALID_STREAM', message: /from 2 s to 1\.5 s at step 3;/ });
    target.step(3);
    assert.deepEqual((target.steps ?? target.waiting).map((one) => one.timeS), [-1, 2, 2, 3]);
  }
  for (const time of [null, '0.1']) assert.throws(() => stream.step(time), /^TypeError: time is .* simulation time/);
  stream.isFull = false;
  await assert.rejects(stream.close(), carillon.ServerUnavailable);
});

test('a message about a job that waits says why', () => {
  const shown = (wait) => stateOf({ state: 'JOB_STATE_QUEUED', wait });
  assert.equal(shown({ earlierJobCount: 3 }), 'queued (waiting: 3 jobs are before it)');
  assert.equal(shown({ cause: 'WAIT_CAUSE_MEMORY', runningJobCount: 1, runningJobLabel: 'bowl' }),
    'queued (waiting for the memory of bowl)');
  assert.equal(shown({ cause: 'WAIT_CAUSE_WORKER', runningJobCount: 2 }), 'queued (waiting for one of 2 jobs)');
  assert.equal(stateOf({ state: 'JOB_STATE_RUNNING' }), 'running');
});

test('a step that is refused makes no other step lost', async () => {
  const stream = stoppedStream();
  for (let i = 0; i < 4096; i += 1) stream.step(i);
  assert.equal(stream.waiting.length, 4096);
  assert.throws(() => stream.step(4096, { contact: [] }), TypeError);
  assert.throws(() => stream.step(0), { reason: 'INVALID_STREAM' });
  assert.equal(stream.droppedStepCount, 0);
  stream.step(4096);
  assert.equal(stream.droppedStepCount, 1);
  stream.isFull = false;
  await assert.rejects(stream.close(), carillon.ServerUnavailable);
});

test('a label that the daemon would cut within a letter is not told as another one', async () => {
  const longest = `${'x'.repeat(198)}ö`; // 200 bytes
  const toldOf = (wanted) => warningsOf(() => warnOfLabel('bell', wanted));
  assert.equal((await toldOf(longest)).length, 1);
  assert.deepEqual(await toldOf(`x${longest}`), []);
});

test('a message that is too large tells how to repair it', () => {
  const error = { code: 8, details: 'Received message larger than max (2500022 vs. 2097152)', metadata: new Metadata() };
  assert.equal(fromCall(error, 'unix:/nowhere').message, 'MESSAGE_TOO_LARGE: a message of 2500022 bytes: the daemon ' +
    'takes at most 2097152; report fewer points in a step, or ask for less in one call');
});

test('a refusal is told as the daemon wrote it, with the first remedy', () => {
  const info = { reason: 'INVALID', message: 'step_s is 0; say', remedies: [{ field: 'settings.mesh.repair', value: 'true' }] };
  assert.equal(fromInfo(info).message, 'INVALID: step_s is 0; say; it may help to set settings.mesh.repair to true');
});

test('all that a user meets is shown in one short line', () => {
  const trace = new carillon.Trace();
  trace.add('modalModels/1');
  trace.step(0.5);
  for (const [item, expected] of [
    [c, '<Client of unix:/nowhere>'], [scene, '<Scene scenes/1 of unix:/nowhere>'],
    [bell, '<SoundingObject 3: 1 mode, 440.0 to 440.0 Hz>'],
    [new carillon.Model(c, { name: 'modalModels/1', label: 'bell', header: { modeCount: 1 } }), '<Model bell: 1 mode>'],
    [trace, '<Trace: 1 object, 1 step, to 0.5 s>'],
    [new carillon.Sound(new Float32Array(4800), 48000, 1), '<Sound: 0.1 s, 48000 Hz, 1 channel, peak 0>'],
  ]) assert.equal(inspect(item), expected);
});

test('an input of Abaqus comes with the files in its folder that it includes', async () => {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'carillon-'));
  const read = async (text) => {
    fs.writeFileSync(path.join(folder, 'bar.inp'), text);
    return (await toMeshFile(path.join(folder, 'bar.inp'))).data.toString();
  };
  try {
    fs.mkdirSync(path.join(folder, 'data'));
    fs.writeFileSync(path.join(folder, 'data/corners.inc'), '1, 0, 0, 0\n*Include, input="data/more.inc"\n');
    fs.writeFileSync(path.join(folder, 'data/more.inc'), '2, 1, 0, 0');
    assert.equal(await read('*NODE, INPUT = data\\corners.inc, NSET=all\r\n** *INCLUDE, INPUT=no\n*STEP\n'),
      '*NODE, NSET=all\n**@ 1 data/corners.inc\n1, 0, 0, 0\n**@ 1 data/more.inc\n2, 1, 0, 0\n' +
      '**@ 3 data/corners.inc\n**@ 2 \n** *INCLUDE, INPUT=no\n*STEP\n');
    for (const name of ['../bar.inc', '/etc/passwd', 'bar.inp']) {
      await assert.rejects(read(`*INCLUDE, INPUT=${name}\n`), (error) => error.message.includes(name));
    }
  } finally {
    fs.rmSync(folder, { recursive: true });
  }
});
