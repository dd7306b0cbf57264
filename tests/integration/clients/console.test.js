// SPDX-License-Identifier: Apache-2.0
'use strict';

const assert = require('node:assert/strict');
const { randomBytes } = require('node:crypto');
const { once } = require('node:events');
const fs = require('node:fs');
const http = require('node:http');
const path = require('node:path');
const test = require('node:test');
const { setTimeout: sleep } = require('node:timers/promises');
const WebSocket = require('ws');
const { chromium } = require('playwright-core');

const address = new URL(process.env.CARILLON_CONSOLE);
const origin = `http://${address.host}`;
const pictures = process.env.CARILLON_TEST_PICTURES;

function get(target, headers = {}, port = address.port) {
  return new Promise((resolve, reject) => {
    http.get({ host: address.hostname, port, path: target, headers }, (response) => {
      response.resume();
      response.on('end', () => resolve(response));
    }).on('error', reject);
  });
}

async function cookie() {
  const response = await get(address.pathname + address.search);
  assert.equal(response.statusCode, 303);
  const [set] = response.headers['set-cookie'];
  assert.match(set, /HttpOnly; SameSite=Strict/);
  return set.split(';')[0];
}

/** 'open', or the status with which a WebSocket was refused. */
function upgrade(headers) {
  return new Promise((resolve) => {
    const socket = new WebSocket(`ws://${address.host}/tunnel`, { headers });
    socket.on('open', () => { socket.close(); resolve('open'); });
    socket.on('unexpected-response', (_request, response) => { response.destroy(); resolve(response.statusCode); });
    socket.on('error', () => {});
  });
}

/** A tunnel of a browser that has shown the token. */
async function openTunnel() {
  const socket = new WebSocket(`ws://${address.host}/tunnel`, { headers: { cookie: await cookie(), origin } });
  await once(socket, 'open');
  return socket;
}

function frame(kind, call, body = '') {
  const bytes = Buffer.alloc(5 + body.length);
  bytes[0] = kind;
  bytes.writeUInt32LE(call, 1);
  bytes.write(body, 5);
  return bytes;
}

test('only a browser that has shown the token is let in, and of 200 strangers none', async () => {
  const mine = await cookie();
  const page = await get('/', { cookie: mine });
  assert.equal(page.statusCode, 200);
  assert.match(page.headers['content-security-policy'], /default-src 'none'/);
  assert.equal(page.headers['cross-origin-embedder-policy'], 'require-corp');
  assert.equal((await get('/../../etc/passwd', { cookie: mine })).statusCode, 404);
  assert.equal(await upgrade({ cookie: mine, origin }), 'open');
  const [name, value] = mine.split('=');
  const wrong = () => randomBytes(32).toString('hex');
  const statusOf = async (target, headers) => (await get(target, headers)).statusCode;
  const strangers = [
    [401, () => statusOf('/')],
    [401, () => statusOf(`/?token=${wrong()}`)],
    [401, () => statusOf('/main.js', { cookie: `other-${name}=${value}` })],
    [421, () => statusOf('/', { cookie: mine, host: `${wrong()}.example` })],
    [421, () => statusOf('/', { cookie: mine, host: `127.0.0.1.${wrong()}.example:80` })],
    [421, () => statusOf(address.pathname + address.search, { host: `${wrong()}.example` })],
    [403, () => upgrade({ origin })],
    [403, () => upgrade({ cookie: mine })],
    [403, () => upgrade({ cookie: mine, origin: `http://${wrong()}.example` })],
    [403, () => upgrade({ cookie: mine, origin: `http://localhost:${address.port}` })],
    [403, () => upgrade({ cookie: mine, origin: 'null' })],
    [403, () => upgrade({ cookie: mine, origin: origin.replace('http', 'https') })],
    [403, () => upgrade({ cookie: `${name}=${wrong()}`, origin })],
    [403, () => upgrade({ cookie: `${name}=${value}0`, origin })],
    [403, () => upgrade({ cookie: mine, origin: `http://${wrong()}.example`, host: `${wrong()}.example` })],
  ];
  for (let i = 0; i < 200; i += 1) {
    const [expected, attempt] = strangers[i % strangers.length];
    assert.equal(await attempt(), expected, `stranger ${i % strangers.length}`);
  }
});

const residentBytes = () => Number(/VmRSS:\s+(\d+)/.exec(fs.readFileSync(`/proc/${process.env.CARILLON_CONSOLE_PID}/status`, 'utf8'))[1]) * 1024;

test('a flood of calls and a reader that never reads take bounded memory', { timeout: 120000 }, async () => {
  const greedy = await openTunnel();
  const codes = [];
  greedy.on('message', (bytes) => { if (bytes[0] === 4) codes.push(bytes.readUInt32LE(5)); });
  for (let call = 0; call < 500; call += 1) greedy.send(frame(0, call, '/carillon.v1.ContactService/StreamContacts'));
  while (codes.length < 436) await sleep(10);
  assert.deepEqual([...new Set(codes)], [8]);  // RESOURCE_EXHAUSTED, for all but 64
  greedy.terminate();

  // The output in small blocks is 190 kB a second. One that does not read it loses them at the daemon.
  const slow = await openTunnel();
  slow.pause();
  const before = residentBytes();
  for (let call = 0; call < 30; call += 1) {
    for (const kind of [0, 1, 2]) slow.send(frame(kind, call, kind ? '' : '/carillon.v1.AudioService/Listen'));
  }
  await sleep(4000);  // 23 MB of sound
  assert.ok(residentBytes() - before < 12 << 20, `${residentBytes() - before} bytes more`);
  slow.terminate();

  // A connection that ends amid a frame ends alone.
  const raw = require('node:net').connect(address.port, address.hostname);
  const mine = await cookie();
  raw.write(`GET /tunnel HTTP/1.1\r\nHost: ${address.host}\r\nOrigin: ${origin}\r\nCookie: ${mine}\r\nUpgrade: websocket\r\n`
    + 'Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n');
  await once(raw, 'data');
  raw.end(Buffer.from([0x82, 0xfe, 0xff]));
  await once(raw, 'close');
  assert.equal((await get('/', { cookie: mine })).statusCode, 200);
});

test('a tunnel serves no administration, and ends at a frame that is none', async () => {
  const socket = await openTunnel();
  const codes = {};
  socket.on('message', (bytes) => { if (bytes[0] === 4) codes[bytes.readUInt32LE(1)] = bytes.readUInt32LE(5); });
  socket.send(frame(0, 7, '/carillon.v1.AdminService/GetDatabaseStats'));
  socket.send(frame(0, 8, '/carillon.worker.v1.JobRunService/FetchMesh'));
  socket.send(frame(0, 9, '/carillon.v1.ServerService/GetServerInfo'));
  socket.send(frame(1, 9));
  socket.send(frame(2, 9));
  while (Object.keys(codes).length < 3) await sleep(10);
  assert.deepEqual(codes, { 7: 7, 8: 7, 9: 0 });
  const closed = once(socket, 'close');
  socket.send(Buffer.from([4, 1, 0, 0, 0]));
  assert.equal((await closed)[0], 1002);
});

/** The brightness of pixels of a screenshot, 0 to 255, of which each is the mean of red, green and blue. */
function brightnessAt(page, screenshot, places) {
  return page.evaluate(async ([base64, wanted]) => {
    const image = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))]));
    const pen = new OffscreenCanvas(image.width, image.height).getContext('2d');
    pen.drawImage(image, 0, 0);
    return wanted.map(([x, y]) => pen.getImageData(x, y, 1, 1).data.slice(0, 3).reduce((sum, part) => sum + part / 3, 0));
  }, [screenshot.toString('base64'), places]);
}

/** The variance of the brightness of a part of a screenshot, which is 0 if nothing is drawn there. */
async function variance(page, selector, file) {
  const picture = await page.locator(selector).screenshot({ path: path.join(pictures, file) });
  return page.evaluate(async (base64) => {
    const image = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))]));
    const pen = new OffscreenCanvas(image.width, image.height).getContext('2d');
    pen.drawImage(image, 0, 0);
    const { data } = pen.getImageData(0, 0, image.width, image.height);
    let sum = 0, squares = 0;
    for (let i = 0; i < data.length; i += 4) { sum += data[i]; squares += data[i] ** 2; }
    const count = data.length / 4;
    return squares / count - (sum / count) ** 2;
  }, picture.toString('base64'));
}

/** Runs `work` with the console, or a page of one's own, in Chromium, which must report no error. */
async function inBrowser(work, target = address.href) {
  const browser = await chromium.launch({ executablePath: '/usr/bin/chromium', args: process.getuid() === 0 ? ['--no-sandbox'] : [] });
  try {
    const page = await browser.newPage({ viewport: { width: 1200, height: 800 } });
    page.setDefaultTimeout(120000);
    const faults = [];
    page.on('pageerror', (error) => faults.push(error.message));
    page.on('console', (message) => { if (message.type() === 'error') faults.push(message.text()); });
    await page.goto(target);
    await work(page).catch(async (error) => {
      error.message += `; the page says: ${await page.locator('.news, .fault').allTextContents()} ${faults}`;
      throw error;
    });
    assert.deepEqual(faults, []);
  } finally {
    await browser.close();
  }
}

/** axe-core's findings about the page as it is, in light and in dark colours. */
async function accessibilityFaults(page) {
  await page.evaluate(fs.readFileSync(require.resolve('axe-core/axe.min.js'), 'utf8'));
  const faults = [];
  for (const colorScheme of ['dark', 'light']) {
    await page.emulateMedia({ colorScheme });
    faults.push(...await page.evaluate(async () => (await globalThis.axe.run()).violations.map(({ id, nodes }) => `${id}: ${nodes[0].html}`)));
  }
  return faults;
}

const samplesOf = (wave) => new Float32Array(new Uint8Array(wave.subarray(44)).buffer);

async function keepPicture(page, name) {
  await page.screenshot({ path: path.join(pictures, name) });
  if (process.env.CARILLON_KEEP_PICTURES) fs.copyFileSync(path.join(pictures, name), path.join(process.env.CARILLON_KEEP_PICTURES, name));
}

const isModelReady = () => carillonConsole.state.model.value && !carillonConsole.state.upload.value && !carillonConsole.state.busy.value;

/** Figures of the object of the page's own scene, as the daemon has it. */
const objectOf = (page) => page.evaluate(async () => {
  const { state } = carillonConsole;
  const { objects } = await state.services.scenes.listObjects({ scene: state.sceneName() });
  const [{ lowestFrequencyHz, radiation, material }] = objects;
  return { lowestFrequencyHz, radiation, youngPa: material.youngPa };
});

/** Waits until the lowest mode of that object sounds at this frequency. */
async function soundsAt(page, hz) {
  while (Math.abs((await objectOf(page)).lowestFrequencyHz / hz - 1) >= 1e-3) await sleep(20);
}

async function saveWave(page, button = page.getByText('Save WAV')) {
  const [download] = await Promise.all([page.waitForEvent('download'), button.click()]);
  return { name: download.suggestedFilename(), wave: fs.readFileSync(await download.path()) };
}

test('in Chromium a mesh becomes a model that is seen, struck and heard', { timeout: 400000 }, () => inBrowser(async (page) => {
  assert.equal(await page.evaluate(() => crossOriginIsolated), true);
  await page.locator('input[type=file]').setInputFiles(process.env.CARILLON_TEST_BAR);
  await page.waitForFunction(isModelReady);
  assert.equal(await page.locator('.fault').count(), 0);
  // The slender bar of the tests bends first at the frequency of beam theory, in steel.
  const modes = await page.evaluate(() => carillonConsole.state.modes.value.map((mode) => mode.frequencyHz));
  assert.ok(Math.abs(modes[0] / Number(process.env.CARILLON_TEST_BAR_HZ) - 1) < 0.02, `${modes[0]} Hz`);
  assert.ok(await variance(page, '.body', 'body.png') > 100);

  // A click at the middle of the picture strikes the bar there, and is heard here at the bar's frequencies.
  const box = await page.locator('.body').boundingBox();
  const click = () => page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  await click();
  await page.waitForFunction(() => carillonConsole.state.row.value && carillonConsole.player.node);
  await page.evaluate(() => {
    carillonConsole.view().paused = true;
    globalThis.played = [];
    carillonConsole.player.onSamples = (samples) => { played.push(...samples); };
    carillonConsole.player.observe({ tap: true, adapt: false });
    globalThis.sent = [];
    globalThis.lostFrames = 0;
    void (async () => {
      for await (const { block, lostFrameCount } of carillonConsole.state.services.audio.listen({})) {
        if (block) {
          sent.push(...new Float32Array(block.samples.slice().buffer));
          globalThis.sentFrame = block.firstFrame;
        }
        lostFrames = Number(lostFrameCount);
      }
    })();
  });
  await page.waitForFunction(() => sent.length > 0 && played.length > 0);
  await click();
  const found = await page.waitForFunction(() => {
    const begin = played.findIndex((sample) => Math.abs(sample) > 1e-6);
    return begin >= 0 && played.length - begin > 16384 && sent.length > 96000 && { begin };
  });
  assert.ok((await found.jsonValue()).begin >= 0);
  // The other listener may be behind on a busy machine; it must have all that was played.
  await page.evaluate(async () => {
    carillonConsole.player.onSamples = () => {};
    globalThis.playedFrame = (await carillonConsole.state.services.audio.getMixer({})).frameCount;
  });
  await page.waitForFunction(() => sentFrame > playedFrame);
  // With the rate loop off, what the audio thread plays are the daemon's samples, bit for bit, but for the silence of gaps.
  const { equal, other, lost } = await page.evaluate(() => {
    const quantum = 128;
    let equal = 0, other = 0, place = 0;
    for (let i = 0; i + quantum <= played.length; i += quantum) {
      const block = played.slice(i, i + quantum);
      if (block.every((sample) => sample === 0)) continue;
      let at = place;
      while (at + quantum <= sent.length && !block.every((sample, k) => sample === sent[at + k])) at += 1;
      // What was played before the other listener began is not among its blocks.
      if (at + quantum > sent.length) other += equal ? 1 : 0;
      else { equal += 1; place = at + quantum; }
    }
    // A starved page loses whole blocks of the daemon, which the other listener may have; two parts of each are mixed.
    return { equal, other, lost: (lostFrames + carillonConsole.player.lostFrames) / quantum };
  });
  assert.ok(equal >= 50, `${equal} blocks of 128 frames are equal`);
  assert.ok(other <= 2 * lost, `${other} blocks differ, ${lost} were lost`);

  assert.ok(await variance(page, '.spectrum', 'spectrum.png') > 100);
  assert.ok(await variance(page, '.spectrogram', 'spectrogram.png') > 2);  // a busy machine draws few columns
  await page.evaluate(() => { carillonConsole.view().paused = false; });
  await page.getByRole('listbox').press('ArrowDown');
  assert.equal(await page.locator('.modes [aria-selected=true]').count(), 1);
  // The first mode has two nodal lines: the ends and the middle move, and a mode shape changes the picture.
  await page.waitForFunction(() => carillonConsole.state.model.value.shapes.get(0));
  await keepPicture(page, 'console_strike.png');

  // A mode that is shown stays in sight while points of it are struck, so that its nodal lines can be.
  await click();
  await page.waitForFunction(() => carillonConsole.state.row.value);
  assert.equal(await page.evaluate(() => carillonConsole.state.chosenMode.value), 0);

  // Another material of another Poisson's ratio sounds at once, as its speed of sound says, and the page says what is not exact.
  const firstHz = () => page.evaluate(() => carillonConsole.state.modes.value[0].frequencyHz);
  const lowestHz = async () => [await firstHz(), (await objectOf(page)).lowestFrequencyHz];
  // A material that was found from recordings is dropped like a mesh, and sounds at once.
  const spoon = '# E/rho\nyoung_pa: 101e9\npoisson_ratio: 0.34\ndensity_kg_per_m3: 8470\nloss_factor {\n  frequency_hz: 468\n  loss_factor: 0.0004\n}\n';
  await page.locator('input[type=file]').setInputFiles({ name: 'spoon.textproto', mimeType: 'text/plain', buffer: Buffer.from(spoon) });
  await page.waitForFunction(() => carillonConsole.state.materialName.value === 'spoon' && !carillonConsole.state.busy.value);
  for (const hz of await lowestHz()) assert.ok(Math.abs(hz / modes[0] / Math.sqrt(101e9 / 8470 / (2.1e11 / 7850)) - 1) < 0.03, `${hz} Hz`);
  await page.locator('input[type=file]').setInputFiles({ name: 'none.textproto', mimeType: 'text/plain', buffer: Buffer.from('young_pa: x') });
  await page.getByText('none.textproto is no material').waitFor();
  await page.getByLabel(/^Material/).selectOption('soda_lime_glass');
  await page.getByText('another Poisson’s ratio').waitFor();
  const speed = await page.evaluate(() => {
    const of = (name) => carillonConsole.state.materials.value.find((entry) => entry.name === name).material;
    const [glass, steel] = [of('soda_lime_glass'), of('structural_steel')];
    return Math.sqrt(glass.youngPa / glass.densityKgPerM3 / (steel.youngPa / steel.densityKgPerM3));
  });
  await page.waitForFunction(() => !carillonConsole.state.busy.value);
  for (const hz of await lowestHz()) assert.ok(Math.abs(hz / modes[0] / speed - 1) < 1e-3, `${hz} Hz`);
  assert.equal(await page.locator('.fault').count(), 0);
  await page.getByLabel(/^Material/).selectOption('structural_steel');

  // Half the size is twice the frequency; the page and the daemon agree.
  const half = page.getByLabel(/^Size/);
  await half.fill('-0.3');
  await half.dispatchEvent('change');
  const factor = 10 ** 0.3;
  await soundsAt(page, modes[0] * factor);
  assert.ok(Math.abs(await firstHz() / modes[0] / factor - 1) < 1e-3);

  const field = page.getByLabel('Tune mode 1 to');
  const tune = async (text) => {
    await field.fill(text);
    await field.press('Enter');
  };
  await tune('A4');
  await soundsAt(page, 440);
  const sizeNow = () => page.evaluate(() => carillonConsole.state.size.value);
  const tuned = await sizeNow();
  for (const text of ['banana', '-3', 'H4']) {
    await tune(text);
    assert.ok(await field.evaluate((element) => !element.validity.valid), text);
    assert.equal(await sizeNow(), tuned);
  }
  for (const [text, hz] of [['Bb4', 466.164], ['a4 +20', 445.112], ['440 Hz', 440]]) {
    await tune(text);
    assert.ok(Math.abs(await sizeNow() / tuned * hz / 440 - 1) < 1e-5, text);
  }
  await page.getByLabel('Exactly').fill('0.5');
  await page.getByLabel('Exactly').press('Enter');
  await page.waitForFunction((lowest) => Math.abs(carillonConsole.state.modes.value[0].frequencyHz / lowest / 2 - 1) < 1e-3, modes[0]);

  // The keyboard alone strikes another point, and one of the side that was hidden.
  await page.evaluate(() => {
    const { services, sceneName } = carillonConsole.state;
    void (async () => {
      for await (const news of services.contacts.watchContacts({ scene: sceneName() })) (globalThis.blows ??= []).push(...news.blows);
    })();
  });
  await page.waitForFunction(() => globalThis.blows);
  await page.locator('.body').focus();
  const places = [];
  for (const keys of ['Shift+ArrowRight', 'Shift+ArrowRight', 'Control+Shift+ArrowRight']) {
    await page.evaluate(() => { globalThis.former = carillonConsole.state.strike.value; });
    await page.keyboard.press(keys);
    await page.waitForFunction(() => carillonConsole.state.strike.value !== former);
    places.push(await page.evaluate(() => carillonConsole.state.strike.value.point));
  }
  const [coarse, fine] = [1, 2].map((i) => Math.hypot(...places[i].map((coordinate, axis) => coordinate - places[i - 1][axis])));
  assert.ok(fine > 0.05 * coarse && fine < 0.2 * coarse, `steps of ${coarse} and ${fine} m`);
  const strikeByKey = async () => {
    const count = await page.evaluate(() => blows.length);
    await page.keyboard.press('Space');
    await page.waitForFunction((known) => blows.length > known, count);
    const { at, normal, blow } = await page.evaluate(() => {
      const { point, normal } = carillonConsole.state.strike.value, { x, y, z } = blows.at(-1).pointM;
      return { at: point.map((coordinate) => coordinate * carillonConsole.state.size.value), normal, blow: [x, y, z] };
    });
    assert.ok(Math.hypot(...at.map((coordinate, axis) => coordinate - blow[axis])) < 1e-4, `${at} m is not ${blow} m`);
    return normal;
  };
  const front = await strikeByKey();
  assert.deepEqual(await page.evaluate(() => carillonConsole.state.strike.value.point), places[2]);
  for (let turn = 0; turn < 31; turn += 1) await page.keyboard.press('ArrowRight');
  for (let turn = 0; turn < 10; turn += 1) await page.keyboard.press('ArrowDown');
  // A turn leaves the point where it is; the next step goes on from there, on the side that is seen.
  assert.deepEqual(await strikeByKey(), front);
  assert.deepEqual(await page.evaluate(() => carillonConsole.state.strike.value.point), places[2]);
  await page.keyboard.press('Shift+ArrowRight');
  const back = await strikeByKey();
  assert.ok(front.reduce((sum, part, axis) => sum + part * back[axis], 0) < 0.5, `${front} and ${back} are normals of one side`);

  // What the test keeps for its comparison, and the motion, have no processor left for a rendering.
  await page.evaluate(() => {
    carillonConsole.view().paused = true;
    carillonConsole.player.observe({ tap: false });
  });
  const { name, wave } = await saveWave(page);
  assert.equal(wave.toString('latin1', 0, 4), 'RIFF');
  assert.equal(name, 'bar_structural_steel.wav');
  assert.ok(samplesOf(wave).some((sample) => Math.abs(sample) > 1e-5));
  assert.deepEqual(await accessibilityFaults(page), []);
}));

/** The amplitude of a partial about a time, through a Hann window of 0.2 s. */
function partialAt(samples, hz, s) {
  const length = 9600, begin = Math.round(s * 48000);
  let re = 0, im = 0;
  for (let i = 0; i < length; i += 1) {
    const value = samples[begin + i] * (1 - Math.cos(2 * Math.PI * i / length));
    re += value * Math.cos(2 * Math.PI * hz * i / 48000);
    im += value * Math.sin(2 * Math.PI * hz * i / 48000);
  }
  return Math.hypot(re, im) / length;
}

test('every material of the catalogue sounds, and T60 and levels in the table are those that sound', { timeout: 400000 }, () => inBrowser(async (page) => {
  await page.waitForFunction(isModelReady);
  const names = await page.evaluate(() => carillonConsole.state.materials.value.map(({ name }) => name));
  assert.ok(names.length >= 46);
  for (const name of [...names, 'structural_steel']) {
    await page.getByLabel(/^Material/).selectOption(name);
    const { youngPa, modes } = await page.evaluate(async () => {
      const { state } = carillonConsole;
      await state.updateObject();
      return { youngPa: state.material.value.youngPa, modes: state.modes.value.map((mode) => mode.frequencyHz) };
    });
    const { lowestFrequencyHz: hz, youngPa: sounding } = await objectOf(page);
    assert.equal(sounding, youngPa, name);
    // Modes that are damped too much do not sound.
    assert.ok(modes.some((one) => Math.abs(hz / one - 1) < 1e-3), `${name}: ${hz} Hz is none of ${modes}`);
    assert.equal(await page.locator('.fault').count(), 0, name);
  }

  const table = () => page.evaluate(() => carillonConsole.state.modes.value.map(({ frequencyHz, t60S, levelPa, moves }) =>
    ({ frequencyHz, t60S, levelPa, moves })));
  const ofMaterial = await table();
  await page.getByRole('button', { name: 'Compute it' }).click();
  await page.getByText('with the radiation into air.').waitFor();
  assert.equal((await objectOf(page)).radiation, 2);  // RADIATION_MODEL_RADIATED_POWER
  await page.evaluate(() => { void carillonConsole.strikeOutermost(); });
  await page.waitForFunction(() => carillonConsole.state.row.value);
  const modes = await table();
  const samples = samplesOf((await saveWave(page)).wave);
  const loudest = Math.max(...modes.map((mode) => mode.levelPa));
  const alone = modes.filter((mode) => mode.levelPa > 1e-3 * loudest && mode.t60S > 0.5 && modes.every((other) => other === mode
    || Math.abs(other.frequencyHz - mode.frequencyHz) > 40 || other.levelPa < 1e-3 * mode.levelPa));
  const measured = alone.map((mode) => {
    const s = Math.min(mode.t60S / 3, samples.length / 48000 - 0.25);
    const [first, then] = [0.01, 0.01 + s].map((at) => partialAt(samples, mode.frequencyHz, at));
    return { ...mode, measuredT60S: s * Math.log(1000) / Math.log(first / then), first, byMaterialS: ofMaterial[modes.indexOf(mode)].t60S };
  });
  assert.ok(measured.length >= 3);
  for (const { frequencyHz, t60S, measuredT60S } of measured) {
    assert.ok(Math.abs(t60S / measuredT60S - 1) < 0.05, `${frequencyHz} Hz: the table has ${t60S} s, the sound ${measuredT60S} s`);
  }
  assert.ok(measured.some(({ byMaterialS, measuredT60S }) => byMaterialS > 1.5 * measuredT60S));
  // The hammer softens neighbours equally: their levels at the beginning differ as in the table.
  const gain = ({ first, t60S, levelPa }) => 20 * Math.log10(first / levelPa) + 60 * 0.11 / t60S;
  const steps = measured.flatMap((one) => measured.filter(({ frequencyHz }) => frequencyHz > one.frequencyHz && frequencyHz < 1.1 * one.frequencyHz)
    .map((other) => gain(other) - gain(one)));
  assert.ok(steps.length && steps.every((dB) => Math.abs(dB) < 1.5), `${steps} dB`);
}));

test('with less motion a mode stands still, and its nodal lines are seen without colours, too', { timeout: 400000 }, () => inBrowser(async (page) => {
  await page.emulateMedia({ reducedMotion: 'reduce' });
  await page.reload();
  await page.waitForFunction(isModelReady);
  const devtools = await page.context().newCDPSession(page);
  await devtools.send('Emulation.setEmulatedVisionDeficiency', { type: 'achromatopsia' });
  await page.getByRole('listbox').press('ArrowDown');
  await page.waitForFunction(() => carillonConsole.state.model.value.shapes.get(0));
  await page.waitForTimeout(1500);
  const still = await page.locator('.body').screenshot({ path: path.join(pictures, 'grey.png') });
  await page.waitForTimeout(1500);
  assert.ok(still.equals(await page.locator('.body').screenshot()), 'the body moves');
  // A free bar's first bending mode is at rest at 0.224 of the length from each end, and moves there least.
  const shares = [0.03, 0.224, 0.5, 0.776, 0.97];
  const places = await page.evaluate((along) => {
    const { camera, canvas } = carillonConsole.view();
    const { vertices } = carillonConsole.state.model.value;
    const [low, high] = [Math.min, Math.max].map((of) => [0, 1, 2].map((axis) => of(...vertices.filter((_, i) => i % 3 === axis))));
    return along.map((share) => {
      const { x, y } = camera.position.clone().set(low[0] + share * (high[0] - low[0]), (low[1] + high[1]) / 2, high[2]).project(camera);
      return [Math.round((x + 1) / 2 * canvas.clientWidth), Math.round((1 - y) / 2 * canvas.clientHeight)];
    });
  }, shares);
  const [end, node, middle, otherNode, otherEnd] = await brightnessAt(page, still, places);
  assert.ok(Math.max(node, otherNode) < 0.7 * Math.min(end, middle, otherEnd), `${[end, node, middle, otherNode, otherEnd]}`);
}));

test('the first click turns the sound on, also on its button', { timeout: 400000 }, () => inBrowser(async (page) => {
  await page.waitForFunction(() => carillonConsole.state.sceneName() && carillonConsole.state.mixer.value && !carillonConsole.state.busy.value);
  await page.getByRole('button', { name: 'Sound here: off' }).click();
  await page.waitForFunction(() => carillonConsole.player.node);
  // A browser that was late too often is asked for more latency, and plays on.
  const before = await page.evaluate(() => {
    const { player } = carillonConsole, { baseLatency } = player.context;
    player.gapsOfContext = () => 5;
    player.adjustLatency();
    delete player.gapsOfContext;
    return baseLatency;
  });
  await page.waitForFunction((least) => carillonConsole.player.context.baseLatency > least, before);
  const played = await page.evaluate(() => carillonConsole.player.playedS());
  await page.waitForFunction((since) => carillonConsole.player.playedS() > since + 0.2, played);
  assert.ok(await page.evaluate(() => carillonConsole.player.gaps) >= 5);
  await page.getByRole('button', { name: 'Sound here: on' }).click();
  await page.waitForFunction(() => !carillonConsole.player.node);
}));

test('a refused mesh is shown with the place that is wrong, and repaired by a button', { timeout: 400000 }, () => inBrowser(async (page) => {
  await page.locator('input[type=file]').setInputFiles(process.env.CARILLON_TEST_OPEN);
  await page.getByText('MESH_NOT_CLOSED').or(page.getByText('open edges')).waitFor();
  assert.ok(await variance(page, '.body', 'refused.png') > 100);
  // No other body can be struck beside it, and it is there again after another view.
  const isAlone = async () => {
    assert.equal(await page.evaluate(() => carillonConsole.state.model.value ?? carillonConsole.state.strike.value ?? 'none'), 'none');
    assert.equal(await page.locator('.creation select').first().locator('option:checked').textContent(), 'open.obj');
    assert.ok(await page.getByRole('button', { name: 'Strike again' }).isDisabled());
  };
  await isAlone();
  await page.getByRole('link', { name: 'Models' }).click();
  await page.locator('.models img').first().waitFor();
  await page.getByRole('link', { name: 'Strike' }).click();
  await page.getByText('open edges').waitFor();
  await isAlone();
  await page.getByRole('button', { name: 'Repair it' }).click();
  await page.waitForFunction(isModelReady);
}));

test('a file of an unknown unit shows its size at once, and is asked about', { timeout: 400000 }, () => inBrowser(async (page) => {
  const metres = fs.readFileSync(process.env.CARILLON_TEST_BAR, 'utf8');
  const buffer = Buffer.from(metres.replace(/^v (.*)$/gm, (_, place) => `v ${place.trim().split(/\s+/).map((x) => 1000 * x).join(' ')}`));
  await page.locator('input[type=file]').setInputFiles({ name: 'bar_mm.obj', mimeType: 'model/obj', buffer });
  await page.locator('.sides').getByText(/^\d{3} × \d+ × \d+ m$/).waitFor();
  const asWide = (await page.locator('.sides').textContent()).replace(' m', ' mm');
  await page.getByRole('button', { name: 'It is in millimetres' }).click();
  await page.waitForFunction(isModelReady);
  assert.equal(await page.locator('.sides').textContent(), asWide);
  const hz = await page.evaluate(() => carillonConsole.state.modes.value[0].frequencyHz);
  assert.ok(Math.abs(hz / Number(process.env.CARILLON_TEST_BAR_HZ) - 1) < 0.02, `${hz} Hz`);
  await page.reload();
  assert.equal(await page.getByLabel('its unit').inputValue(), '0.001');
}));

test('a running simulator is seen, and why it is silent', { timeout: 400000 }, () => inBrowser(async (page) => {
  await page.getByRole('link', { name: 'Live' }).click();
  await page.locator('.chain .broken').getByText('The scene is muted.').waitFor();
  await page.waitForFunction(() => carillonConsole.live.blows.value.length >= 3);
  const { handle, impulse } = await page.evaluate(() => {
    const { blow } = carillonConsole.live.blows.value[0];
    return { handle: blow.object, impulse: blow.impulseNewtonSeconds.z };
  });
  assert.ok([1, 2, 3].includes(handle));
  assert.ok(Math.abs(impulse - 0.02) < 1e-6, `${impulse}`);
  const poses = await page.evaluate(() => carillonConsole.live.objects.value.map((object) => object.pose.positionM.x));
  assert.deepEqual(poses, [0, 0.5, 1]);
  // A picture of software takes its time: it is taken while nothing moves.
  await page.evaluate(() => { carillonConsole.live.watching.value = false; });
  assert.ok(await variance(page, '.scene', 'scene.png') > 5);  // three slender bars
  await page.evaluate(() => { carillonConsole.live.watching.value = true; });
  await page.getByRole('button', { name: 'Unmute' }).press('Enter');
  await page.waitForFunction(() => carillonConsole.live.scene.value.muted === false);
  await page.waitForFunction(() => !document.querySelector('.chain .broken'));
  // Bodies of gain 0 are why nothing is heard, too.
  await page.evaluate(async () => {
    for (const { name } of carillonConsole.live.objects.value) await carillonConsole.state.services.scenes.updateObject({ name, gain: 0 });
  });
  await page.locator('.chain .broken').getByText('The gain of every body is 0.').waitFor();
  await page.getByRole('button', { name: 'Set them to 1' }).press('Enter');
  await page.waitForFunction(() => !document.querySelector('.chain .broken'));
  // The page's own scene gives way to a simulator's.
  const theirs = await page.evaluate(() => {
    const { live, state } = carillonConsole, was = live.sceneName.value;
    live.sceneName.value = state.sceneName();
    return was;
  });
  await page.waitForFunction((name) => carillonConsole.live.sceneName.value === name, theirs);
  // A click in the spectrogram finds the blow that is heard there, and the step that made it.
  const { played, rendered } = await page.evaluate(async () => {
    const played = carillonConsole.player.playedS();
    const { frameCount, format } = await carillonConsole.state.services.audio.getMixer({});
    return { played, rendered: Number(frameCount) / format.sampleRateHz };
  });
  assert.ok(played < rendered && rendered - played < 5, `${played} s are played, ${rendered} s rendered`);
  const spectrogram = await page.locator('.spectrogram:visible').boundingBox();
  const origin = page.locator('.origin');
  // A busy machine has the simulator strike less often.
  while (!await origin.count()) {
    await page.mouse.click(spectrogram.x + spectrogram.width - 20, spectrogram.y + 20);
    await page.waitForTimeout(300);
  }
  await page.evaluate(() => { carillonConsole.live.watching.value = false; });
  assert.match(await origin.textContent(), /on bar [123], point .* mm .*, 0\.020 N s, from the step at about -?\d+\.\d+ s/);
  await keepPicture(page, 'console_live.png');
  assert.deepEqual(await accessibilityFaults(page), []);
  // A contact that is rejected among others that sound is red, with its reason, and is not why nothing is heard.
  await page.evaluate(async () => {
    const { live, state } = carillonConsole;
    live.watching.value = true;
    async function* steps() {
      yield { start: { scene: live.sceneName.value, stepS: 0.01 } };
      for (let step = 0; !globalThis.seen; step += 1) {
        yield { steps: [{ timeS: 0.5 * step, contacts: [{ kind: 2, object: 99, location: { case: 'pointM', value: { x: 0, y: 0, z: 0 } },
          action: { case: 'impulseNewtonSeconds', value: { x: 0, y: 0, z: 1 } } }] }] };
        await new Promise((resolve) => { setTimeout(resolve, 500); });
      }
    }
    void (async () => { for await (const report of state.services.contacts.streamContacts(steps())) void report; })();
  });
  await page.locator('.chain .faulty').getByText(/[1-9]\d* rejected.*The last rejected: ./).waitFor();
  await page.evaluate(() => { globalThis.seen = true; });
}));

test('the models are listed with their pictures, and the space bar lets one be heard', { timeout: 400000 }, () => inBrowser(async (page) => {
  await page.getByRole('link', { name: 'Models' }).click();
  await page.locator('.models img').first().waitFor();
  await page.getByLabel('Label').fill('bar');
  await page.locator('.models').focus();
  await page.keyboard.press('Space');
  await page.waitForFunction(() => carillonConsole.state.row.value && carillonConsole.state.mixer.value?.activeModeCount > 0);
  assert.ok(await variance(page, '.models img >> nth=0', 'thumbnail.png') > 100);
  await keepPicture(page, 'console_models.png');
  assert.deepEqual(await accessibilityFaults(page), []);
}));

/** What is played of a trace, in its view and in its page alike. */
async function checkTrace(page, right) {
  await page.waitForFunction(() => (globalThis.carillonTrace ?? globalThis.carillonConsole?.trace)?.trace.value);
  const { blows, labels, seconds, rate } = await page.evaluate(() => {
    globalThis.shown = globalThis.carillonTrace ?? carillonConsole.trace;
    const one = shown.trace.value;
    return { blows: one.blows.map((blow) => [blow.object, blow.timeS]), labels: [...one.labels.values()],
      seconds: one.sound.duration, rate: one.sound.sampleRate };
  });
  assert.deepEqual(labels, ['left', right]);
  assert.deepEqual(blows.map(([object]) => object), [1, 2, 1, 2, 1, 2]);
  blows.forEach(([, time], i) => assert.ok(Math.abs(time - 0.1 * i) < 0.005, `${time} s`));
  assert.ok(seconds > 0.7 && rate === 48000, `${seconds} s`);
  // The sound begins to be loud at each blow, as the time line draws it.
  const rises = await page.evaluate(() => {
    const samples = shown.trace.value.sound.getChannelData(0);
    const energy = (from) => samples.slice(from, from + 480).reduce((sum, sample) => sum + sample * sample, 0);
    return [1, 2, 3, 4, 5].map((i) => energy(4800 * i + 48) / (energy(4800 * i - 600) + 1e-20));
  });
  assert.ok(rises.every((rise) => rise > 10), `${rises}`);
  const box = await page.locator('.line').boundingBox();
  await page.mouse.click(box.x + 110 + (box.width - 110) * 0.5 / seconds, box.y + 30);
  const poses = await page.evaluate(() => shown.objects.value.map(({ pose }) => pose.positionM.y));
  assert.ok(Math.abs(poses[0] - 0.5) < 1e-3 || Math.abs(poses[0] - 0.4) < 1e-3, `${poses}`);
  assert.ok(await variance(page, '.scene', 'trace_bodies.png') > 2);
  assert.ok(await variance(page, '.line', 'trace_line.png') > 100);
  await page.locator('.line').press('Space');
  await page.waitForFunction(() => shown.timeS.value > 0.6);
  assert.deepEqual(await accessibilityFaults(page), []);
}

test('a trace is rendered, seen and played, and saved as a sound', { timeout: 400000 }, () => inBrowser(async (page) => {
  await page.getByRole('link', { name: 'Trace' }).click();
  await page.locator('main:visible input[type=file]').setInputFiles(process.env.CARILLON_TEST_TRACE);
  await checkTrace(page, 'right');
  assert.equal((await saveWave(page, page.getByText('Save WAV').last())).wave.toString('latin1', 0, 4), 'RIFF');
  await page.evaluate(() => { carillonConsole.trace.stop(); carillonConsole.trace.seek(0.3); });
  await keepPicture(page, 'console_trace.png');
}));

test('the page of a trace needs no server', { timeout: 400000 }, () => inBrowser(async (page) => {
  await checkTrace(page, 'right</script>');
}, `file://${process.env.CARILLON_TEST_PAGE}`));

test('thirty bodies of a page of one’s own fall in Rapier, and are heard', { timeout: 400000 }, () => inBrowser(async (page) => {
  await page.waitForFunction(() => globalThis.example);
  await page.mouse.click(300, 300);
  await page.waitForFunction(() => example.carillon.player.analyser);
  await page.evaluate(() => {
    const { player } = example.carillon;
    globalThis.loudest = 0;
    player.onSamples = (samples) => { loudest = Math.max(loudest, ...samples.map(Math.abs)); };
    player.observe({ tap: true });
  });
  // They fall from up to five metres, and lie at last.
  await page.waitForFunction(() => example.bodies.every((body) => Math.abs(body.translation().y) < 0.3) && loudest > 1e-4);
  await page.waitForFunction(() => example.scene.report?.acceptedCount > 30n);
  const { rejected, dropped, poses } = await page.evaluate(async () => {
    const { objects } = await example.carillon.services.scenes.listObjects({ scene: example.scene.name });
    return { rejected: Number(example.scene.report.rejectedCount), dropped: Number(example.scene.report.droppedCount),
      poses: objects.map(({ pose }) => pose.positionM.y) };
  });
  assert.deepEqual([rejected, dropped, poses.length], [0, 0, 30]);
  assert.ok(Math.max(...poses) < 5, `${poses}`);
  assert.ok(await variance(page, 'canvas', 'example.png') > 20);
  await keepPicture(page, 'console_example.png');
}, process.env.CARILLON_EXAMPLE));

test('a page of one’s own needs the cookie, and none outside of its folder is served', async () => {
  const example = new URL(process.env.CARILLON_EXAMPLE);
  const ask = (target, headers) => get(target, headers, example.port);
  assert.equal((await ask('/pages/')).statusCode, 401);
  const shown = await ask(example.pathname + example.search);
  assert.deepEqual([shown.statusCode, shown.headers.location], [303, '/pages/']);
  assert.equal((await ask(`//evil.example/${example.search}`)).statusCode, 401);
  const headers = { cookie: shown.headers['set-cookie'][0].split(';')[0] };
  const page = await ask('/pages/', headers);
  assert.equal(page.statusCode, 200);
  assert.equal(page.headers['cross-origin-embedder-policy'], 'require-corp');
  for (const target of ['/pages/../bar.obj', '/pages/../../../../etc/passwd', '/pages//etc/passwd', '/pages/.']) {
    assert.equal((await ask(target, headers)).statusCode, 404, target);
  }
  assert.equal((await get('/pages/', { cookie: await cookie() })).statusCode, 404);
});

test('after the daemon was killed and started again, the page strikes as before', { timeout: 400000 }, () => inBrowser(async (page) => {
  await page.waitForFunction(isModelReady);
  const scene = await page.evaluate(() => carillonConsole.state.sceneName());
  const box = await page.locator('.body').boundingBox();
  const click = () => page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  process.kill(Number(process.env.CARILLON_DAEMON_PID), 'SIGKILL');
  // The modes at a point that is struck now are read when the daemon is back.
  await click();
  await page.waitForFunction((old) => carillonConsole.state.sceneName() !== old && !carillonConsole.state.busy.value
    && carillonConsole.state.row.value, scene);
  await click();
  await page.waitForFunction(async () => (await carillonConsole.state.services.audio.getMixer({})).activeModeCount > 0);
  assert.equal(await page.locator('.fault').count(), 0);
}));

test('the console ends well while calls are under way', { timeout: 60000 }, async () => {
  const socket = await openTunnel();
  const heard = once(socket, 'message');
  for (let call = 0; call < 30; call += 1) for (const kind of [0, 1, 2]) socket.send(frame(kind, call, kind ? '' : '/carillon.v1.AudioService/Listen'));
  await heard;
  const closed = once(socket, 'close');
  process.kill(Number(process.env.CARILLON_CONSOLE_PID), 'SIGTERM');
  await closed;  // test_console.py asks for the status
});
