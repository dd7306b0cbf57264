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

function refused(expected, content) {
  assert.throws(() => new carillon.Trace({ step: 1 / 240 }).step(0, content), (error) => error.message.includes(expected)
    || assert.fail(error.message));
}

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

test('one place has the same coordinates for both objects in the frame of the scene alone', () => {
  const columns = { objects: 1, points: [1, 2, 3], impulses: IMPULSE, secondObjects: 2 };
  const row = { object: 1, point: [1, 2, 3], impulse: IMPULSE, second: { object: 2 } };
  refused("secondPoints is undefined; it must be numbers, 3 a contact: metres in the second object's own frame, or in the " +
    "scene's", { contacts: columns });
  refused('point of second of contacts[0] is undefined', { contacts: [row] });
  const trace = new carillon.Trace({ step: 1 / 240, frame: 'scene' });
  trace.step(0, { contacts: columns });
  trace.step(0, { contacts: [row] });
  assert.deepEqual(trace.steps[0].contactColumns[0].secondPointM, [1, 2, 3]);
  assert.deepEqual(trace.steps[1].contacts[0].second.pointM, { x: 1, y: 2, z: 3 });
});

test('what is no mesh is refused', async () => {
  for (const wrong of [5, null, {}, { vertices: [[0, 0, 0]] }]) {
    await assert.rejects(c.createModel(wrong, { material: 'oak' }),
      /^TypeError: the mesh is .*; it must be the path of a file, or { vertices, triangles }/);
  }
});

test('a misspelt key is refused with the nearest name', async () => {
  const refusals = [
    [() => c.createModel(mesh, { material: 'oak', max_frequency: 1 }), 'max_frequency', 'maxFrequencyHz'],
    [() => c.createModel(mesh, { material: { young: 1 } }), 'young', 'youngPa'],
    [() => c.createModel(mesh, { material: 'oak', settings: { meters_per_unit: 1 } }), 'meters_per_unit',
      'metresPerUnit'],
    [() => c.render(new carillon.Trace(), { tail: 1 }), 'tail', 'tailS'],
    [() => c.listen({ scen: 'x' }), 'scen', 'scene'],
    [() => c.createScene({ listner: POINT }), 'listner', 'listener'],
    [() => scene.add('modalModels/1', { gian: 1 }), 'gian', 'gain'],
    [() => scene.addAll([{ model: 'modalModels/1', gian: 1 }]), 'gian', 'gain'],
    [() => bell.strike({ point: POINT, impuls: IMPULSE }), 'impuls', 'impulse'],
    [async () => new carillon.Trace({ stp: 1 }), 'stp', 'step'],
    [async () => scene.stream({ stepp: 1 }), 'stepp', 'step'],
    [async () => carillon.connect('unix:/x', { tlsRoot: 'x' }), 'tlsRoot', 'tlsRoots'],
  ];
  for (const [call, wrong, right] of refusals) {
    await assert.rejects(call, (error) => error.message.includes(`no "${wrong}"; did you mean "${right}"?`)
      || assert.fail(error.message));
  }
  refused('contacts[0] has no "impluse"; did you mean "impulse"?',
    { contacts: [{ object: 1, point: POINT, impluse: IMPULSE }] });
  refused('contacts has no "point"; did you mean "points"?', { contacts: { objects: 1, point: POINT } });
  refused('step has no "contact"; did you mean "contacts"?', { contact: [] });
});

test('a setting at the wrong level is refused with the right one', async () => {
  for (const [wrong, right] of [['poissonRatio', 'settings: { poissonRatio: ... } or material: { poissonRatio: ... }'],
    ['budgetS', 'settings: { mesh: { budgetS: ... } } or transfer: { budgetS: ... }']]) {
    await assert.rejects(c.createModel(mesh, { material: 'oak', [wrong]: 1 }),
      (error) => error.message.includes(`createModel has no "${wrong}"; give it as ${right}`) || assert.fail(error.message));
  }
  await assert.rejects(c.createModel(mesh, { material: 'oak', accuracys: 0.1 }), /did you mean "accuracy"\?/);
  await assert.rejects(c.createScene({ panning: true }), /"panning"; give it as hearing: \{ panning: ... \}/);
});

test('the unit and the accuracy become settings', async () => {
  const made = toSettings({ poissonRatio: 0.3 }, 'mm', 0.01);
  assert.deepEqual(made, { poissonRatio: 0.3, metresPerUnit: 0.001, mesh: { accuracy: 0.01 } });
  assert.deepEqual(toSettings(undefined, 2), { metresPerUnit: 2 });
  for (const [expected, wrong] of [
    ["unit is 'km'; it must be \"m\", \"cm\", \"mm\", \"in\", or a number of metres above zero", { unit: 'km' }],
    ['unit is 0; it must be', { unit: 0 }],
    ['accuracy is 1; it must be a number above 0 and below 1, such as 0.01 for 1 %', { accuracy: 1 }],
    ['unit and settings.metresPerUnit are both given; leave one of them out',
      { unit: 'mm', settings: { metresPerUnit: 1 } }],
  ]) {
    await assert.rejects(c.createModel(mesh, { material: 'oak', ...wrong }),
      (error) => error.message.includes(expected) || assert.fail(error.message));
  }
});

test('a wrong word or kind of value is refused by its name', async () => {
  assert.throws(() => new carillon.Trace({ frame: 'world' }), /frame is 'world'; it must be one of "object", "scene"/);
  assert.throws(() => new carillon.Trace({ pulseShape: 'box' }), /"raised_cosine", "gaussian"/);
  assert.throws(() => new carillon.Trace().add('modalModels/1', { radiation: 'none' }), /"modes_only"/);
  await assert.rejects(c.jobs({ states: ['broken'] }).next(), /an entry of states is 'broken'; .*"failed"/);
  await assert.rejects(c.render(new carillon.Trace(), { tailS: 'long' }), /tailS of render is 'long'; .* a number/);
  await assert.rejects(c.listen({ encoding: 'int16' }), /encoding of listen is 'int16'; .*AUDIO_ENCODING_INT16/);
  await assert.rejects(c.createModel(mesh), /material is undefined; it must be a name such as 'oak'/);
});

test('the name of a material may come alone or before the rest of a request', async () => {
  for (const words of [['oak'], ['oak', { size: 2 }], [{ material: 'oak', size: 2 }]]) {
    await assert.rejects(c.createModel(mesh, ...words), carillon.ServerUnavailable);
  }
  await assert.rejects(c.createModel(mesh, 'oak', { unti: 'mm' }), /createModel has no "unti"; did you mean "unit"\?/);
  for (const words of [['oak', { material: 'oak' }], [{ material: 'oak' }, { size: 2 }]]) {
    await assert.rejects(c.createModel(mesh, ...words), /two materials or requests; .* createModel\(mesh, 'oak', \{/);
  }
});

test('what is no object where keys are wanted is refused', async () => {
  for (const [call, wanted] of [
    [() => c.createModel(mesh, 5), 'createModel is given 5; give an object, such as { material: ... }'],
    [() => c.createModel(mesh, 'oak', 2), 'createModel is given 2'], [() => c.createModel(mesh, null), 'is given null'],
    [() => scene.add('modalModels/1', 'oak'), "add is given 'oak'; give an object, such as { material: ... }"],
    [async () => new carillon.Trace().add('modalModels/1', 'oak'), "add is given 'oak'; give an object"],
    [() => bell.update('louder'), "update is given 'louder'; give an object, such as { material: ... }"],
    [async () => new carillon.Trace().step(0, { impacts: [7] }), 'impacts[0] is given 7']]) {
    await assert.rejects(call, (error) => error.message.includes(wanted) || assert.fail(error.message));
  }
});

test('contacts are refused by their names, with unit and frame', async () => {
  const own = "in the stream's frame, which is each object's own unless it was opened with frame: 'scene'";
  refused(`point of contacts[1] is [ 0, 0 ]; it must be [x, y, z]: metres ${own}`,
    { contacts: [{ object: 1, point: POINT, impulse: IMPULSE }, { object: 1, point: [0, 0], impulse: IMPULSE }] });
  refused(`impulse of impacts[0] is undefined; it must be [x, y, z]: newton seconds ${own}`,
    { impacts: [{ object: 1, point: POINT }] });
  refused('object of contacts[0] is undefined', { contacts: [{ point: POINT, impulse: IMPULSE }] });
  refused(`points has 2 numbers; it must have 3 a contact: metres ${own}`,
    { contacts: { objects: 1, points: [0, 0], impulses: IMPULSE } });
  refused('points is undefined; it must be numbers, 3 a contact', { contacts: { objects: 1, impulses: IMPULSE } });
  refused('points has the numbers of 1 contact and impulses has those of 2',
    { contacts: { objects: 1, points: POINT, impulses: [IMPULSE, IMPULSE] } });
  refused("listener is [ 1, 2 ]; it must be [x, y, z]: metres in the scene's frame", { listener: [1, 2] });
  await assert.rejects(bell.strike({ point: [0, 0], impulse: IMPULSE }),
    /point is \[ 0, 0 \]; it must be \[x, y, z\]: metres in the object's own frame/);
});

test('a strike without an impulse is refused, because it would be silent', async () => {
  await assert.rejects(bell.strike({ point: POINT, impulse: [0, 0, 0] }),
    /impulse is \[ 0, 0, 0 \]; it must be other than zero, because the strike would be silent/);
  new carillon.Trace().step(0, { impacts: { objects: 1, points: POINT, impulses: [0, 0, 0] } });
});

test('a message about a job that waits says why', () => {
  const shown = (wait) => stateOf({ state: 'JOB_STATE_QUEUED', wait });
  assert.equal(shown({ earlierJobCount: 3 }), 'queued (waiting: 3 jobs are before it)');
  assert.equal(shown({ cause: 'WAIT_CAUSE_MEMORY', runningJobCount: 1, runningJobLabel: 'bowl' }),
    'queued (waiting for the memory of bowl)');
  assert.equal(shown({ cause: 'WAIT_CAUSE_WORKER', runningJobCount: 2 }), 'queued (waiting for one of 2 jobs)');
  assert.equal(stateOf({ state: 'JOB_STATE_RUNNING' }), 'running');
});

test('handles and partners that are no whole numbers of 32 bits are refused', () => {
  for (const wrong of ['floor', '5', 1.7, -1, 1 + 2 ** 32, NaN]) {
    const shown = inspect(wrong);
    const row = { object: 1, point: POINT, impulse: IMPULSE };
    const object = 'it must be an object that scene.add or trace.add returned, or its handle, a whole number';
    const partner = 'it must be a whole number from 0 to 4294967295 that names the other body';
    refused(`object of impacts[0] is ${shown}; ${object}`, { impacts: [{ ...row, object: wrong }] });
    refused(`partner of contacts[0] is ${shown}; ${partner}`, { contacts: [{ ...row, partner: wrong }] });
    const columns = { objects: 1, points: POINT, impulses: IMPULSE };
    refused(`an entry of objects is ${shown}; ${object}`, { impacts: { ...columns, objects: [wrong] } });
    for (const partners of [wrong, [wrong]]) {
      refused(`an entry of partners is ${shown}; ${partner}`, { contacts: { ...columns, partners } });
    }
    assert.throws(() => new carillon.Trace().add('modalModels/1', { handle: wrong }), /handle of add is .* whole number/);
  }
});

test('a negative duration is refused, and an undefined one is left to the daemon', async () => {
  const wanted = 'it must be zero seconds or more, or NaN, which leaves it to the daemon';
  const columns = { objects: 1, points: POINT, impulses: IMPULSE };
  refused(`an entry of durations is -5; ${wanted}`, { impacts: { ...columns, durations: -5 } });
  refused(`duration of impacts[0] is -5; ${wanted}`, { impacts: [{ object: 1, point: POINT, impulse: IMPULSE,
    duration: -5 }] });
  await assert.rejects(bell.strike({ point: POINT, impulse: IMPULSE, duration: -5 }), /duration is -5; it must be zero/);
  const trace = new carillon.Trace();
  trace.step(0, { impacts: { ...columns, durations: NaN } });
  trace.step(0, { impacts: [{ object: 1, point: POINT, impulse: IMPULSE, duration: NaN }] });
  assert.deepEqual(trace.steps[0].contactColumns[0].durationS, [-1]);
  assert.equal('durationS' in trace.steps[1].contacts[0], false);
});

test('a trace of contacts needs the length of its steps, as a stream does', () => {
  const contacts = [{ object: 1, point: POINT, impulse: IMPULSE }];
  assert.throws(() => new carillon.Trace().step(0, { contacts }), /new Trace\(\{ step: 1 \/ 240 \}\)/);
  new carillon.Trace().step(0, { impacts: contacts });
  new carillon.Trace({ step: 1 / 240 }).step(0, { contacts });
});

test('a step whose time is too large or goes back is refused, and the trace can be continued', () => {
  const trace = new carillon.Trace();
  for (const time of [NaN, Infinity, -1.1e10]) {
    assert.throws(() => trace.step(time), { name: 'CarillonError', reason: 'INVALID_STREAM' });
  }
  trace.step(-1);
  trace.step(2);
  assert.throws(() => trace.step(1.5), { reason: 'INVALID_STREAM', message: /goes back from 2 s to 1\.5 s at step 2;/ });
  trace.step(2);
  assert.deepEqual(trace.steps.map((step) => step.timeS), [-1, 2, 2]);
});

test('a step whose time is too large or goes back is refused at once, and the stream can go on', async () => {
  const stream = stoppedStream();
  for (const time of [NaN, Infinity, -1.1e10]) {
    assert.throws(() => stream.step(time), { reason: 'INVALID_STREAM', message: /the time of step 0 is/ });
  }
  for (const time of [null, '0.1']) assert.throws(() => stream.step(time), /^TypeError: time is .* simulation time/);
  for (const time of [-1, 2, 2]) stream.step(time);
  assert.throws(() => stream.step(1.5), { reason: 'INVALID_STREAM',
    message: /goes back from 2 s to 1\.5 s at step 3; open another stream for another run$/ });
  stream.step(3);
  assert.deepEqual(stream.waiting.map((step) => step.timeS), [-1, 2, 2, 3]);
  stream.isFull = false;
  await assert.rejects(stream.close(), carillon.ServerUnavailable);
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

test('an empty name of a model is refused with the name of the argument', async () => {
  for (const text of ['', 'modalModels/', 3]) {
    await assert.rejects(c.model(text), { name: 'TypeError',
      message: `the model is ${inspect(text)}; it must be its label, its name, or the first digits of its digest` });
  }
  await assert.rejects(scene.add(''), /^TypeError: the model is ''; it must be a Model/);
  assert.throws(() => new carillon.Trace().add(''), /^TypeError: the model is ''; it must be a Model/);
});

test('text in place of a number is refused with the name of the field', async () => {
  const refusedText = async (name, call) => assert.rejects(async () => call(), { name: 'TypeError',
    message: `${name} is '0.5'; it must be a number${name.startsWith('gain') ? linear : ''}` });
  const linear = '. A gain is a linear factor: 1 keeps the level, and 10 ** (x / 20) changes it by x decibels';
  const text = '0.5';
  const row = { object: 1, point: POINT, impulse: IMPULSE };
  const trace = new carillon.Trace({ step: 1 / 240 });
  for (const [name, call] of [
    ['gain of add', () => scene.add('modalModels/1', { gain: text })],
    ['size of object 0 of addAll', () => scene.addAll([{ model: 'modalModels/1', size: text }])],
    ['gain of add', () => trace.add('modalModels/1', { gain: text })],
    ['gain of update', () => bell.update({ gain: text })], ['glide of update', () => bell.update({ glide: text })],
    ['gain of update', () => scene.update({ gain: text })], ['gain of setVolume', () => c.setVolume({ gain: text })],
    ['gain of createScene', () => c.createScene({ gain: text })],
    ['glide of moveListener', () => scene.moveListener(POINT, text)],
    ['step of stream', () => scene.stream({ step: text })],
    ['delay of stream', () => scene.stream({ step: 0.01, delay: text })],
    ['step of Trace', () => new carillon.Trace({ step: text })],
    ['timeOffset of impacts[0]', () => trace.step(0, { impacts: [{ ...row, timeOffset: text }] })],
    ['roughnessDepth of contacts', () => trace.step(0, { contacts: { objects: 1, points: POINT, impulses: IMPULSE,
      roughnessDepth: text } })],
    ['seconds of renderStrike', () => new carillon.Model(c, { name: 'modalModels/1' }).renderStrike({ point: POINT,
      impulse: IMPULSE, seconds: text })],
  ]) await refusedText(name, call);
  assert.equal(trace.objects.length + trace.steps.length, 0);
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
