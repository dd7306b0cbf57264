// SPDX-License-Identifier: Apache-2.0
import { render } from 'preact';
import { signal } from '@preact/signals';
import { LivePage } from './live_page';
import { ModelsPage } from './models_page';
import { gapsOf, hasDevice, player, playerChanged, soundByGesture, sounding, toggleSound } from './sounding';
import * as state from './state';
import * as live from './live_state';
import { TracePage } from './trace_page';
import * as trace from './trace_state';
import { audition, strikeOutermost, StrikePage, view } from './strike_page';

const TABS = { strike: 'Strike', live: 'Live', models: 'Models', trace: 'Trace' } as const;
const tabOf = (hash: string) => (hash.slice(1) in TABS ? hash.slice(1) as keyof typeof TABS : 'strike');
const tab = signal(tabOf(location.hash));
addEventListener('hashchange', () => { tab.value = tabOf(location.hash); });
addEventListener('pointerdown', soundByGesture, { capture: true });
addEventListener('keydown', soundByGesture, { capture: true });

function Header() {
  const mixer = state.mixer.value;
  playerChanged.value;
  const level = mixer && mixer.peak > 0 ? `${(20 * Math.log10(mixer.peak)).toFixed(0)} dBFS`.replace('-', '−') : 'silence';
  return <header><h1>Carillon</h1>
    <nav aria-label="Views">{Object.entries(TABS).map(([name, title]) => <a href={`#${name}`} aria-current={tab.value === name ? 'page' : undefined}>{title}</a>)}</nav>
    <span>{mixer ? `${hasDevice() ? mixer.device : `${mixer.device} (no loudspeaker)`}, load ${(100 * mixer.load).toFixed(1)} %, ${mixer.activeModeCount} modes ring, ${level}` : 'no daemon'}</span>
    <span>{sounding.value && player.gaps ? gapsOf(player.gaps) : ''}</span>
    <label class="volume">Volume here <input type="range" min="0" max="60" step="1" value={player.volumeDb}
      onInput={(event) => { player.volumeDb = Number(event.currentTarget.value); }} /></label>
    <button class="sound" aria-pressed={sounding.value} title={hasDevice() ? 'The daemon sounds on its own device' : ''} onClick={() => void toggleSound()}>
      {sounding.value ? 'Sound here: on' : 'Sound here: off'}</button></header>;
}

function Page() {
  // The body stays in its view while others are looked at.
  return <><Header /><div class="page" hidden={tab.value !== 'strike'}><StrikePage /></div>
    {tab.value === 'live' && <LivePage />}{tab.value === 'trace' && <TracePage />}{tab.value === 'models' && <ModelsPage audition={(model) => void audition(model)} />}</>;
}

render(<Page />, document.body);
Object.assign(globalThis, { carillonConsole: { player, state, live, strikeOutermost, trace, view: () => view } });
