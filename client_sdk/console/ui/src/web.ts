// SPDX-License-Identifier: Apache-2.0
// The package @carillon/web: bodies of a page's own simulation, heard through the console's socket.
import { create } from '@bufbuild/protobuf';
import type { MessageInitShape } from '@bufbuild/protobuf';
import { ContactKind, Frame } from './gen/carillon/v1/contact_pb';
import type { ContactSchema } from './gen/carillon/v1/contact_pb';
import { StreamContactsRequestSchema } from './gen/carillon/v1/contact_service_pb';
import type { StreamContactsRequest, StreamContactsResponse } from './gen/carillon/v1/contact_service_pb';
import { JobState } from './gen/carillon/v1/decomposition_pb';
import type { NewObjectSchema } from './gen/carillon/v1/scene_service_pb';
import { Outbox } from './outbox';
import { Player } from './player';
import { servicesOf } from './services';
import type { Services } from './services';
import { errorInfo } from './transport';
import { Tunnel, tunnelAddress } from './tunnel';

export { Player, errorInfo };
export type { Services, StreamContactsResponse };

export type Triple = [number, number, number];

/** A contact in the scene's frame, as the adapters of client_sdk/adapters read it out of an engine: m, N s. */
export interface ContactRow {
  object: number;
  point: Triple;
  impulse: Triple;
  partner?: number;
  second?: { object: number; point: Triple };
  striker?: { striker?: string; strikerMassKg?: number };
}

/** What a step reports. Orientations are quaternions w, x, y, z. */
export interface StepContents {
  contacts?: ContactRow[];
  poses?: { objects: number[]; positions: Triple[]; orientations: number[][] };
}

const vector = ([x, y, z]: Triple) => ({ x, y, z });

function toContact({ object, point, impulse, partner = 0, second, striker }: ContactRow): MessageInitShape<typeof ContactSchema> {
  return { kind: ContactKind.REPORTED, object, partner, hertz: striker,
    location: { case: 'pointM', value: vector(point) }, action: { case: 'impulseNewtonSeconds', value: vector(impulse) },
    second: second && { object: second.object, location: { case: 'pointM', value: vector(second.point) } } };
}

/** A daemon, reached through the console that serves this page. */
export class Carillon {
  readonly player = new Player();

  private constructor(readonly services: Services) {}

  /** Resolves once the console is reached. */
  static connect(address = tunnelAddress()): Promise<Carillon> {
    return new Promise((resolve) => {
      const tunnel = new Tunnel(address, (open) => { if (open) resolve(new Carillon(servicesOf(tunnel))); });
    });
  }

  /**
   * Returns the name of the model of a mesh, which is computed if the daemon does not have it. `format` is "obj", "stl"
   * and so on; `material` is a preset of the catalogue. Throws a ConnectError; errorInfo() has the reason.
   */
  async model(mesh: Uint8Array | string, format: string, material: string, label = ''): Promise<string> {
    const bytes = typeof mesh === 'string' ? new TextEncoder().encode(mesh) : mesh;
    async function* pieces() {
      for (let begin = 0; begin < bytes.length; begin += 1 << 20) yield { data: bytes.subarray(begin, begin + (1 << 20)) };
    }
    const { meshDigest } = await this.services.models.uploadMesh(pieces());
    const created = await this.services.models.createModalModel({ meshDigest, meshFormat: format, label, material: { preset: material } });
    let job = created.job!;
    for await (const news of this.services.jobs.watchJob({ name: job.name })) job = news.job!;
    if (job.state !== JobState.SUCCEEDED) throw new Error(job.error?.message ?? 'the job was cancelled');
    return job.modalModel;
  }

  /** Makes a scene whose simulation has steps of `stepS`. It ends a minute after the page. */
  async scene(stepS: number): Promise<SoundingScene> {
    const { name } = await this.services.scenes.createScene({});
    return new SoundingScene(this.services, name, stepS);
  }

  /** Lets the page sound, with 24 dB more than the daemon's level unless `volumeDb` says otherwise. Call it in a gesture of the user. */
  play(volumeDb = 24): Promise<void> {
    this.player.volumeDb = volumeDb;
    return this.player.start();
  }
}

/** A scene and its contact stream. */
export class SoundingScene {
  /** The daemon's newest report about the stream: counts, findings, warnings. */
  report?: StreamContactsResponse;
  /** Rejects with a ConnectError when the stream is lost, for example with the daemon; the page then makes a new scene. */
  readonly ended: Promise<void>;
  private readonly requests: Outbox<StreamContactsRequest>;

  constructor(private readonly services: Services, readonly name: string, stepS: number) {
    this.requests = new Outbox(create(StreamContactsRequestSchema, { start: { scene: name, stepS, frame: Frame.SCENE } }));
    this.ended = this.read();
  }

  /** Adds an object for each of `objects`, and returns their handles, which contacts name. */
  async add(...objects: MessageInitShape<typeof NewObjectSchema>[]): Promise<number[]> {
    const added = await this.services.scenes.addObjects({ scene: this.name, objects });
    return added.objects.map((object) => object.handle);
  }

  /** Sends a step of the simulation. */
  step(timeS: number, { contacts = [], poses }: StepContents): void {
    this.requests.push(create(StreamContactsRequestSchema, { steps: [{ timeS, contacts: contacts.map(toContact),
      poses: poses && { object: poses.objects, positionM: poses.positions.flat(), orientation: poses.orientations.flat() } }] }));
  }

  private async read(): Promise<void> {
    for await (const report of this.services.contacts.streamContacts(this.requests)) this.report = report;
  }
}
