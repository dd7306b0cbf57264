// SPDX-License-Identifier: Apache-2.0
import { useEffect, useRef, useState } from 'preact/hooks';
import { effect } from '@preact/signals';
import { newtonSeconds, strikerOf } from './blow_text';
import { colorOf, LiveView, MOST_DOTS } from './live_view';
import * as live from './live_state';
import { fetchSurface } from './modal_model';
import { hear, heardScene } from './sounding';
import * as state from './state';
import { SpectrogramView } from './strike_page';

function Picture() {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [shown, setShown] = useState('');
  useEffect(() => {
    const view = new LiveView(canvas.current!, (name) => fetchSurface(state.services, name));
    let newest: live.SeenBlow | undefined;
    const ends = [
      effect(() => {
        const { value: scene } = live.scene;
        void view.update(scene, live.objects.value).then(() => setShown(scene?.name ?? ''));
      }),
      effect(() => {
        const known = live.blows.value.indexOf(newest!);
        for (const blow of live.blows.value.slice(0, Math.min(MOST_DOTS, known < 0 ? MOST_DOTS : known)).reverse()) view.blow(blow);
        [newest] = live.blows.value;
      }),
      effect(() => { if (live.chosen.value) view.blow({ ...live.chosen.value, seenMs: Date.now() }); }),
    ];
    return () => ends.forEach((end) => end());
  }, []);
  const poseless = live.objects.value.length > 0 && live.objects.value.every((object) => !object.pose);
  return <><canvas ref={canvas} class="body scene" tabIndex={0} role="img" aria-label={`The bodies of ${live.sceneName.value}`} />
    {shown !== live.sceneName.value && live.scene.value?.objectCount ? <p class="hint" role="status">Fetching the bodies …</p> : null}
    {poseless && <p class="hint">The simulator sends no poses, so the bodies stand in a row.</p>}</>;
}

function Chain() {
  const links = live.chain.value;
  const first = links.find((link) => link.state === 'broken');
  return <section class="chain"><h2 id="chain">{first ? 'Why nothing is heard' : 'From the simulator to the ear'}</h2>
    <ol aria-labelledby="chain">{links.map((link) => <li class={link === first ? 'broken' : link.state === 'broken' ? 'behind' : link.state}>
      <strong>{link.name}</strong> <span>{link === first || link.state === 'faulty' ? '✗ ' : link.state === 'well' ? '✓ ' : ''}{link.says}</span>
      {link.remedy && <> <button onClick={link.remedy.act}>{link.remedy.text}</button></>}</li>)}</ol></section>;
}

function Findings() {
  const warnings = [...live.streams.value.values()].flatMap((stream) => stream.report.warnings);
  const findings = [...live.streams.value.values()].map((stream) => stream.report.findings);
  const blowCount = findings.reduce((sum, one) => sum + Number(one?.blowCount ?? 0), 0);
  const loadCount = findings.reduce((sum, one) => sum + Number(one?.loadCount ?? 0), 0);
  return <section><h2>Findings</h2>
    <p class="hint">{blowCount} blows and {loadCount} contacts at rest among those that the engine reported
      {live.lostCount.value ? `; this page missed ${live.lostCount.value} messages` : ''}</p>
    {warnings.map((warning) => <p class="warning"><strong>{warning.id}</strong> {warning.text}</p>)}
  </section>;
}

/** A body by the name of its model and its handle. */
function bodyName(handle: number): string {
  const modalModel = live.objects.value.find((object) => object.handle === handle)?.modalModel;
  const known = state.models.value.find((one) => one.name === modalModel);
  return `${known ? state.nameOf(known) : 'body'} ${handle}`;
}

/** The blow that was chosen, and the step that made it. */
function Origin() {
  const chosen = live.chosen.value;
  if (!chosen) return null;
  const { blow } = chosen, stepS = live.stepTimeOf(chosen), { x, y, z } = blow.pointM ?? { x: 0, y: 0, z: 0 };
  return <p role="status" class="origin">The blow at {blow.timeS.toFixed(3)} s on {bodyName(blow.object)}{strikerOf(blow, bodyName) && ` by ${strikerOf(blow, bodyName)}`}, point {[x, y, z]
    .map((metres) => (1000 * metres).toFixed(1)).join(', ')} mm of its frame, {newtonSeconds(blow).toPrecision(2)} N s
    {stepS !== undefined && `, from the step at about ${stepS.toFixed(3)} s after the first`}</p>;
}

function Blows() {
  return <section class="blows"><h2>Newest blows</h2><Origin /><table><thead><tr><th title="on the clock of the daemon’s sound">at s</th><th>body</th><th>by</th><th>N s</th><th>ms</th></tr></thead>
    <tbody>{live.blows.value.slice(0, 12).map((seen) => [seen, seen.blow] as const).map(([seen, blow]) => <tr>
      <td><button class="inline" onClick={() => { live.chosen.value = seen; }}>{blow.timeS.toFixed(3)}</button></td><td><i class="dot" style={{ background: colorOf(blow.object) }} /> {bodyName(blow.object)}</td>
      <td>{strikerOf(blow, bodyName)}</td>
      <td>{newtonSeconds(blow).toPrecision(2)}</td><td>{(1000 * blow.durationS).toFixed(2)}</td></tr>)}</tbody></table></section>;
}

export function LivePage() {
  useEffect(() => { live.watching.value = true; return () => { live.watching.value = false; }; }, []);
  const heard = live.sceneName.value !== '' && heardScene.value === live.sceneName.value;
  return <main>
    <div class="left">
      <section class="creation"><label>Scene <select value={live.sceneName.value} onChange={(event) => { live.chosenByHand.value = true; live.sceneName.value = event.currentTarget.value; }}>
        {live.scenes.value?.map((scene) => <option value={scene.name}>{scene.name}, {scene.objectCount} {scene.objectCount === 1 ? 'body' : 'bodies'}, {live.decibels(scene.peak)}
          {scene.name === state.sceneName() ? ' (this page)' : ''}</option>)}</select></label>
        <label class="tick"><input type="checkbox" checked={heard} onChange={(event) => void hear(event.currentTarget.checked ? live.sceneName.value : '')} /> hear this scene alone</label>
      </section>
      <Picture /><SpectrogramView chosen={live.chooseAt} /></div>
    <div class="right" tabIndex={0} role="region" aria-label="Why nothing is heard, findings and blows"><Chain /><Findings /><Blows />
      {state.fault.value && <p class="fault" role="alert">{state.fault.value.message}</p>}</div></main>;
}
