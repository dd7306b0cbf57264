// SPDX-License-Identifier: Apache-2.0
// Measures the console in Chromium; run.py starts it. Each result is a line of JSON.
'use strict';

const { spawn, execFileSync } = require('node:child_process');
const fs = require('node:fs');
const readline = require('node:readline');
const { chromium } = require('playwright-core');

const tell = (figures) => process.stdout.write(`${JSON.stringify(figures)}\n`);
const sleep = (ms) => new Promise((resolve) => { setTimeout(resolve, ms); });
const round = (value) => Math.round(10 * value) / 10;
const quantile = (values, share) => round([...values].sort((a, b) => a - b)[Math.min(values.length - 1, Math.floor(share * values.length))]);

function cpuSeconds(pid) {
  const fields = fs.readFileSync(`/proc/${pid}/stat`, 'utf8').split(') ')[1].split(' ');
  return (Number(fields[11]) + Number(fields[12])) / 100;
}

const memoryMib = (pid) => Math.round(Number(/VmRSS:\s+(\d+)/.exec(fs.readFileSync(`/proc/${pid}/status`, 'utf8'))[1]) / 1024);

/** The processes below this one by what they are: console, renderer (of the page), audio, gpu, browser. */
function processes() {
  const rows = execFileSync('ps', ['-eo', 'pid=,ppid=,args='], { encoding: 'utf8' }).trim().split('\n')
    .map((row) => /^\s*(\d+)\s+(\d+)\s+(.*)$/.exec(row)).map(([, pid, parent, words]) => ({ pid: Number(pid), parent: Number(parent), words }));
  const mine = new Set([process.pid]);
  for (let size = 0; size !== mine.size;) {
    size = mine.size;
    for (const { pid, parent } of rows) if (mine.has(parent)) mine.add(pid);
  }
  const kinds = { console: /carillon-console/, renderer: /--type=renderer/, audio: /audio\.mojom\.AudioService/, gpu: /--type=gpu/ };
  const found = { daemon: [Number(process.env.CARILLON_DAEMON_PID)] };
  for (const [kind, pattern] of Object.entries(kinds)) found[kind] = rows.filter(({ pid, words }) => mine.has(pid) && pattern.test(words)).map(({ pid }) => pid);
  return found;
}

const total = (pids, of) => pids.reduce((sum, pid) => { try { return sum + of(pid); } catch { return sum; } }, 0);

async function startConsole() {
  const command = spawn('carillon', ['console', '--no-browser', '--port', '0'], { stdio: ['ignore', 'pipe', 'inherit'] });
  const [address] = await require('node:events').once(readline.createInterface({ input: command.stdout }), 'line');
  return { address, stop: () => { command.kill('SIGTERM'); return new Promise((resolve) => { command.on('exit', resolve); }); } };
}

/** The page notes when the ring gets sound, when the audio thread plays it, and when the browser puts it out. */
function instrument() {
  globalThis.figures = { clicks: [], rings: [], outputs: [], worklets: [] };
  const Original = Worker;
  globalThis.Worker = class extends Original {
    constructor(...words) {
      super(...words);
      this.addEventListener('message', ({ data }) => { if (data.memory) globalThis.ring = { memory: data.memory, channels: data.channels }; });
    }
  };
  addEventListener('pointerup', (event) => figures.clicks.push(event.timeStamp), { capture: true });
}

/** Looks at the ring for the first sound; the page must be still otherwise. */
function watchRing() {
  const { memory, channels } = globalThis.ring;
  const head = new Int32Array(memory, 0, 1), samples = new Float32Array(memory, 8);
  const frames = samples.length / channels;
  let seen = Atomics.load(head, 0);
  const { port1, port2 } = new MessageChannel();
  let armed = false;
  globalThis.arm = () => {
    armed = true;
    seen = Atomics.load(head, 0);
    port2.postMessage(0);
  };
  /** Whether the last 85 ms in the ring are silent. */
  globalThis.isSilent = () => {
    const end = Atomics.load(head, 0);
    for (let i = 1; i <= 4096; i += 1) if (Math.abs(samples[((end - i) & (frames - 1)) * channels]) >= 1e-7) return false;
    return true;
  };
  port1.onmessage = () => {
    const now = Atomics.load(head, 0);
    for (; seen !== now; seen = (seen + 1) | 0) {
      if (!armed || Math.abs(samples[(seen & (frames - 1)) * channels]) < 1e-7) continue;
      armed = false;
      figures.rings.push(performance.now());
    }
    if (armed) port2.postMessage(0);
  };
  const { player } = carillonConsole;
  globalThis.heard = true;
  player.onSamples = (block, frame) => {
    const at = heard ? -1 : block.findIndex((sample) => Math.abs(sample) > 1e-7);
    if (at < 0) return;
    heard = true;
    const { contextTime, performanceTime } = player.context.getOutputTimestamp();
    figures.outputs.push(performanceTime + 1000 * ((frame + at) / player.context.sampleRate - contextTime));
    figures.worklets.push(performance.now());
  };
  player.observe({ tap: true });
}

async function inPage(work) {
  const console = await startConsole();
  const browser = await chromium.launch({ executablePath: '/usr/bin/chromium', args: process.getuid() === 0 ? ['--no-sandbox'] : [] });
  try {
    const page = await browser.newPage({ viewport: { width: 1200, height: 800 } });
    page.setDefaultTimeout(300000);
    page.on('pageerror', (error) => process.stderr.write(`${error.stack}\n`));
    await page.addInitScript(instrument);
    await work(page, console.address);
  } finally {
    await browser.close();
    await console.stop();
  }
}

async function clickBody(page) {
  const box = await page.locator('.body').first().boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
}

const isReady = () => carillonConsole.state.model.value && !carillonConsole.state.busy.value;
const isDone = () => carillonConsole.state.model.value && !carillonConsole.state.busy.value && !carillonConsole.state.upload.value;

const measurements = {
  /** From a click to the ring, the audio thread's message and the browser's output, with a body that rings briefly. */
  clicks: () => inPage(async (page, address) => {
    await page.goto(address);
    await page.waitForFunction(() => carillonConsole.state.reached.value && !carillonConsole.state.busy.value);
    await page.locator('input[type=file]').setInputFiles(process.env.MESH);
    await page.waitForFunction(isDone);
    await page.evaluate(() => { carillonConsole.view().paused = true; });
    await clickBody(page);
    await page.waitForFunction(() => carillonConsole.player.node && globalThis.ring);
    await page.evaluate(async () => {
      carillonConsole.state.factors.value = { young: 1, density: 1, damping: 100 };
      await carillonConsole.state.updateObject();
      if (carillonConsole.state.fault.value) throw new Error(carillonConsole.state.fault.value.message);
    });
    await sleep(3000);
    await page.evaluate(watchRing);
    for (let i = 0; i < 40; i += 1) {
      await page.waitForFunction(() => isSilent());
      await sleep(100 + 7 * i);
      await page.evaluate(() => { arm(); heard = false; });
      await clickBody(page);
      await page.waitForFunction((count) => figures.outputs.length > count && figures.rings.length > count, i);
    }
    const { clicks, rings, outputs, worklets } = await page.evaluate(() => figures);
    // The limiter behind the audio thread looks ahead, which no time stamp of the browser counts.
    const limiterMs = await page.evaluate(async () => {
      const context = new OfflineAudioContext(1, 4800, 48000), pulse = new AudioBuffer({ length: 1, sampleRate: 48000 });
      pulse.getChannelData(0)[0] = 0.01;
      const source = new AudioBufferSourceNode(context, { buffer: pulse });
      source.connect(new DynamicsCompressorNode(context, { threshold: -3, knee: 0, ratio: 20 })).connect(context.destination);
      source.start();
      return (await context.startRendering()).getChannelData(0).findIndex((sample) => Math.abs(sample) > 1e-4) / 48;
    });
    const since = (times) => times.map((time, i) => time - clicks[clicks.length - times.length + i]);
    const says = (times) => ({ least: quantile(since(times), 0), median: quantile(since(times), 0.5), p90: quantile(since(times), 0.9) });
    tell({ clicks: rings.length, ring_ms: says(rings), worklet_ms: says(worklets), output_ms: says(outputs.map((time) => time + limiterMs)), limiter_ms: round(limiterMs),
      ...await page.evaluate(() => ({ target: carillonConsole.player.target, gaps: carillonConsole.player.underruns,
        base_latency_ms: 1000 * carillonConsole.player.context.baseLatency, output_latency_ms: 1000 * carillonConsole.player.context.outputLatency })) });
  }),

  /** Gaps and CPU while a scene sounds and the picture rests. */
  scene: () => inPage(async (page, address) => {
    await page.goto(address);
    await page.waitForFunction(isReady);
    await page.evaluate(() => { carillonConsole.view().paused = true; });
    await page.getByRole('button', { name: 'Sound here: off' }).click();
    await page.waitForFunction(() => carillonConsole.player.node);
    await sleep(15000);
    // What the browser itself did not put out in time is a gap, too.
    const gapsNow = () => page.evaluate(() => [carillonConsole.player.underruns, carillonConsole.player.browserGaps]);
    const before = await gapsNow();
    const kinds = processes();
    const cpu = Object.fromEntries(Object.entries(kinds).map(([kind, pids]) => [kind, total(pids, cpuSeconds)]));
    const seconds = Number(process.env.SECONDS);
    await sleep(1000 * seconds);
    const [gaps, browserGaps] = (await gapsNow()).map((count, i) => count - before[i]);
    const { lost, target } = await page.evaluate(() => ({ lost: carillonConsole.player.lostFrames, target: carillonConsole.player.target }));
    const share = Object.fromEntries(Object.entries(kinds).map(([kind, pids]) => [kind, round(100 * (total(pids, cpuSeconds) - cpu[kind]) / seconds)]));
    tell({ seconds, gaps, browser_gaps: browserGaps, gaps_before: before, lost_frames: lost, target_frames: target, cpu_percent: share,
      // Chromium keeps an empty renderer in reserve.
      memory_mib: Object.fromEntries(Object.entries(kinds).map(([kind, pids]) => [kind, Math.max(...pids.map(memoryMib))])) });
  }),
};

void measurements[process.argv[2]]();
