// SPDX-License-Identifier: Apache-2.0
// Listens to the daemon over a tunnel of its own, so that neither the page nor a large export delays the sound.
import { AudioService } from './gen/carillon/v1/audio_service_pb';
import { Ring } from './ring';
import { clientOf } from './transport';
import { Tunnel, tunnelAddress } from './tunnel';

export type ListenNews =
  | { kind: 'format'; sampleRateHz: number; channels: number; memory: SharedArrayBuffer }
  | { kind: 'lost'; frames: number }
  /** The mixer's frame that the ring's first frame would have been. */
  | { kind: 'clock'; origin: number };

const tell = (news: ListenNews) => self.postMessage(news);
const RETRY_MS = 500;

async function listen(tunnel: Tunnel, scene: string): Promise<void> {
  let ring: Ring | undefined;
  let nextFrame: bigint | undefined;
  let lost = 0, origin: number | undefined;
  for await (const { format, block } of clientOf(AudioService, tunnel).listen({ scene })) {
    if (format) {
      ring = new Ring(Ring.allocate(format.channelCount), format.channelCount);
      tell({ kind: 'format', sampleRateHz: format.sampleRateHz, channels: format.channelCount,
        memory: ring.memory as SharedArrayBuffer });
    }
    if (!block || !ring) continue;
    const bytes = block.samples;
    const samples = new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength));
    const missing = nextFrame === undefined ? 0 : Number(block.firstFrame - nextFrame);
    if (missing > 0) {
      // Silence of the same length keeps the clock.
      ring.write(new Float32Array(Math.min(missing, 4096) * ring.channels));
    }
    const begins = Number(block.firstFrame) - ring.written();
    if (begins !== origin) tell({ kind: 'clock', origin: origin = begins });
    // A starved audio thread leaves no place for the newest.
    const now = lost + Math.max(missing, 0) + ring.write(samples);
    if (now > lost) tell({ kind: 'lost', frames: lost = now });
    nextFrame = block.firstFrame + BigInt(samples.length / ring.channels);
  }
}

self.onmessage = async (event: MessageEvent<{ scene: string }>) => {
  const tunnel = new Tunnel(tunnelAddress(), () => {});
  for (;;) {
    await listen(tunnel, event.data.scene).catch(() => {});
    await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
  }
};
