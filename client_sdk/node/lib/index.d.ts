// SPDX-License-Identifier: Apache-2.0
/**
 * The types of the package. Those of the contract's messages, below ../types, and those of contacts are generated when it
 * is packed, from the contract and from contacts.js.
 */

import type { Contact, ContactForce, ContactForces, Contacts, Impact, Impacts, Strike } from './contacts';
import type { ContactFindings__Output } from '../types/carillon/v1/ContactFindings';
import type { ContactStep } from '../types/carillon/v1/ContactStep';
import type { ContactTraceHeader } from '../types/carillon/v1/ContactTraceHeader';
import type { ContactTraceObject } from '../types/carillon/v1/ContactTraceObject';
import type { ContactTraceRecord } from '../types/carillon/v1/ContactTraceRecord';
import type { CreateModalModelRequest } from '../types/carillon/v1/CreateModalModelRequest';
import type { GetMixerResponse__Output } from '../types/carillon/v1/GetMixerResponse';
import type { GetServerInfoResponse__Output } from '../types/carillon/v1/GetServerInfoResponse';
import type { Hearing } from '../types/carillon/v1/Hearing';
import type { HertzContact } from '../types/carillon/v1/HertzContact';
import type { Job__Output } from '../types/carillon/v1/Job';
import type { ListenRequest } from '../types/carillon/v1/ListenRequest';
import type { ListModalModelsRequest } from '../types/carillon/v1/ListModalModelsRequest';
import type { Material as MaterialMessage } from '../types/carillon/v1/Material';
import type { ModalModelSummary__Output } from '../types/carillon/v1/ModalModelSummary';
import type { PerformedImpacts__Output } from '../types/carillon/v1/PerformedImpacts';
import type { RenderSettings } from '../types/carillon/v1/RenderSettings';
import type { Remedy__Output } from '../types/carillon/v1/Remedy';
import type { Blow__Output } from '../types/carillon/v1/Blow';
import type { RenderSummary__Output } from '../types/carillon/v1/RenderSummary';
import type { Scene__Output } from '../types/carillon/v1/Scene';
import type { SoundingObject__Output } from '../types/carillon/v1/SoundingObject';
import type { StreamContactsResponse__Output } from '../types/carillon/v1/StreamContactsResponse';
import type { UpdateMixerResponse__Output } from '../types/carillon/v1/UpdateMixerResponse';
import type { Warning__Output as Warning } from '../types/carillon/v1/Warning';

/** x, y, z in metres or newton seconds. */
export type Vector = ArrayLike<number>;
/** w, x, y, z. */
export type Rotation = ArrayLike<number>;
/** Rows of numbers, flat or an array each. */
export type Table = ArrayLike<number> | ArrayLike<ArrayLike<number>>;
export type Pose = Vector | { position: Vector; orientation?: Rotation };
/** The materials of a body of several ones by the regions of its mesh file; '' stands for all regions without one. */
export interface MaterialOfRegions {
  regions: Record<string, string | MaterialMessage>;
}
/** A name of the catalogue, such as "bell_bronze", figures, or both by regions. */
export type Material = string | MaterialMessage | MaterialOfRegions;
/** A name of the catalogue, such as "wood", or figures. */
export type Striker = string | HertzContact;
export type Radiation = 'paper_coupling' | 'radiated_power' | 'modes_only';
export type ObjectLike = number | SoundingObject;
/** A file, or metres and indices that count from zero. */
export type Mesh = string | { vertices: Table; triangles: Table };

export type { Contact, ContactForce, ContactForces, ContactPlaces, ContactRoughness, Contacts, Impact, Impacts, Second,
  Strike } from './contacts';

/** Columns with the environment of each row of a performance, or one for all, by default 0. */
export type OfEnvironments<Columns> = Columns & { environments?: number | ArrayLike<number> };

/** A microphone at a pose in the scene, or in the frame of the object `on`. It looks along -z of its frame. */
export interface Microphone {
  kind?: 'omni' | 'stereo' | 'ears' | 'ambisonic';
  /** Order of ambisonics, 1 to 3. */
  order?: number;
  pose?: Pose;
  /** Handle of the object that carries it. */
  on?: number;
}

/** Environments whose sound comes in step with their simulation. */
export class Performance {
  readonly environmentCount: number;
  readonly channelCount: number;
  readonly sampleRateHz: number;
  /** Seconds from a contact to its sound. */
  readonly latency: number;
  /** What was probably not meant about the contacts, after `close`. */
  readonly warnings: Warning[];
  /** Adds an object before the contacts of the next step, by default to all environments. Returns its handle. */
  add(model: Model | string, settings?: {
    environments?: number | Iterable<number>; material?: Material; size?: number; gain?: number; pose?: Pose;
    handle?: number; radiation?: Radiation;
  }): number;
  /** Removes an object at the next step. */
  remove(object: number, environments?: number | Iterable<number>): void;
  /** Silence at once, and time zero. */
  reset(environments?: number | Iterable<number>): void;
  /** Performs a step. Samples are [environment][channel][frame]. Throws CarillonError if a part of it is rejected. */
  step(content?: {
    contacts?: OfEnvironments<Contacts>; impacts?: OfEnvironments<Impacts>; forces?: OfEnvironments<ContactForces>;
    poses?: OfEnvironments<NonNullable<StepContent['poses']>>;
    timeScale?: number;
  }): Promise<{ samples: Float32Array; frameCount: number; impacts: PerformedImpacts__Output | null }>;
  /** Ends the performance, and warns as the end of a stream does. Returns the warnings. */
  close(): Promise<Warning[]>;
}

/** What a step has. */
export interface StepContent {
  /** What an engine reports, in every step. */
  contacts?: Contact[] | Contacts;
  /** Strikes. */
  impacts?: Impact[] | Impacts;
  /** Of a simulator that separates resting contacts from impacts itself. */
  forces?: ContactForce[] | ContactForces;
  poses?: { objects: ObjectLike | ArrayLike<ObjectLike>; positions: Table; orientations?: Table };
  listener?: Pose;
  /**
   * Simulation time over time of the sound since the step before: 0.25 in slow motion, 4 in fast forward, 0 in a pause,
   * in which contacts are left out. The default is 1.
   */
  timeScale?: number;
}

export interface StreamSettings {
  /** The frame of points and impulses: each object's own, or that of the scene, in which the poses are. */
  frame?: 'object' | 'scene';
  pulseShape?: 'raised_cosine' | 'gaussian';
}

export interface ObjectSettings {
  material?: Material;
  size?: number;
  /** A linear factor: 1 keeps the level, 0.5 lowers it by 6 dB, and 10 ** (x / 20) changes it by x decibels. */
  gain?: number;
  pose?: Pose;
  handle?: number;
  radiation?: Radiation;
}

/** A refusal. `reason` is stable and one of proto/errors.md's; `metadata` has figures that belong to it. */
export class CarillonError extends Error {
  constructor(reason: string, text: string, metadata?: Record<string, string>, remedies?: Remedy__Output[]);
  readonly reason: string;
  readonly metadata: Record<string, string>;
  /** Changes to the request that may help, the most promising first. */
  readonly remedies: Remedy__Output[];
  /** Of a step that rejected a contact: what it gave all the same. */
  readonly performed?: { samples: Float32Array; frameCount: number; impacts: PerformedImpacts__Output | null };
}

/** No daemon answers at the address. */
export class ServerUnavailable extends CarillonError {}

/** Samples interleaved by channel; full scale is 1. */
export class Sound {
  readonly samples: Float32Array;
  readonly sampleRateHz: number;
  readonly channelCount: number;
  /** What the daemon measured while it rendered the sound offline. */
  readonly summary?: RenderSummary__Output;
  /** The impulses that sounded, if the settings had tellBlows. */
  readonly blows: Blow__Output[];
  readonly seconds: number;
  readonly peak: number;
  /** Writes a WAV file of 24-bit samples. */
  save(path: string): Promise<void>;
  waveBytes(): Buffer;
}

/** A modal model in the daemon's database. */
export class Model {
  readonly summary: ModalModelSummary__Output;
  readonly material?: Material;
  readonly name: string;
  readonly label: string;
  readonly modeCount: number;
  /**
   * Waits until the daemon has computed how the model radiates; before, objects sound by the paper's coupling. Returns at
   * once if no transfer is being computed. Throws CarillonError if the computation failed, or if it has not ended after
   * `timeout` seconds (DEADLINE_EXCEEDED).
   */
  waitForTransfer(options?: { timeout?: number; onProgress?: (job: Job__Output) => void }): Promise<void>;
  /**
   * Renders one strike. The samples are the same each time once the transfer is computed. `seconds` zero means until the
   * sound has died away. The process warns by a TransferWarning if the transfer is still being computed.
   */
  renderStrike(strike: Strike & {
    material?: Material; size?: number; gain?: number; seconds?: number; sampleRateHz?: number;
  }): Promise<Sound>;
}

/** A recorded simulation. */
export class Trace {
  /** `step`, seconds, is needed for contacts, forces and poses, as in a stream. `labels` are text of your own. */
  constructor(settings?: StreamSettings & {
    step?: number; simulator?: string; hearing?: Hearing; listener?: Pose; labels?: Record<string, string>;
  });
  header: ContactTraceHeader;
  objects: ContactTraceObject[];
  steps: ContactStep[];
  /** Adds an object, which is there from the beginning. Returns its handle. */
  add(model: Model | string, settings?: ObjectSettings & { label?: string }): number;
  /**
   * Adds a step. Throws CarillonError (INVALID_STREAM) if the time goes back, or is over 1e10 s before or after 0. A
   * trace without a clock can be rendered if its times are 0 to 86400 s.
   */
  step(time: number, content?: StepContent): void;
  records(): Generator<ContactTraceRecord>;
  bytes(): Buffer;
  /** Writes a .contacts file. */
  write(path: string): Promise<void>;
  static read(path: string): Promise<Trace>;
}

/** An object of a scene. It may be given wherever handles are wanted. */
export class SoundingObject {
  readonly message: SoundingObject__Output;
  readonly name: string;
  readonly handle: number;
  /** Strikes the object now. Throws CarillonError if the strike is refused. */
  strike(strike: Strike): Promise<void>;
  update(changes: Omit<ObjectSettings, 'handle'> & { glide?: number }): Promise<void>;
  remove(): Promise<void>;
}

/** A scene of the daemon. Without `keep` it ends a minute after the last connection that used it is closed. */
export class Scene {
  constructor(client: Client, name: string, existing?: boolean);
  readonly name: string;
  /** The scene was there before its createScene, which had an id. */
  readonly existing: boolean;
  /** Returns its state: volume, peak, and how long it lasts. */
  get(): Promise<Scene__Output>;
  /** Adds all objects, or none if one is refused; `metadata.index` of the error is its place. */
  addAll(objects: Array<ObjectSettings & { model: Model | string }>): Promise<SoundingObject[]>;
  /** Adds an object. Without a material it gets the one that the model was asked for with. */
  add(model: Model | string, settings?: ObjectSettings): Promise<SoundingObject>;
  objects(): Promise<SoundingObject[]>;
  /**
   * Changes the volume, which glides within 30 ms. The gain is a linear factor: 1 keeps the level, and
   * 10 ** (x / 20) changes it by x decibels. If you set `solo` for some of your scenes, the others are not heard.
   */
  update(volume: { gain?: number; muted?: boolean; solo?: boolean }): Promise<Scene__Output>;
  /** Fades out all that sounds in the scene. Later contacts sound. */
  stop(): Promise<void>;
  /** Begins to record the scene alone, before the gain and the limiter of the output. */
  listen(request?: Omit<ListenRequest, 'scene'>): Promise<Recording>;
  moveListener(pose: Pose, glide?: number): Promise<void>;
  /** Opens a stream for a simulation whose steps last `step` seconds, to sound `delay` seconds later. */
  stream(settings: StreamSettings & { step: number; delay?: number }): ContactStream;
  delete(): Promise<void>;
}

/** Sends the contacts of each step. */
export class ContactStream {
  /**
   * The daemon's newest answer, with the counts so far. It counts an impulse as accepted before it sounds: one that is
   * due after the scene is deleted is never heard. Wait for `aheadS`, in seconds, after the end of the stream.
   */
  readonly report?: StreamContactsResponse__Output;
  /** Steps that were not sent: the oldest ones, when 4096 waited. The warning of `close` tells their number, too. */
  readonly droppedStepCount: number;
  /** How many contacts came too late for their time so far, and sounded at once. */
  readonly lateCount: number;
  /** How many times simulation time was mapped anew so far, because every step was late. */
  readonly remapCount: number;
  /** How many steps wait for the network. */
  readonly waitingStepCount: number;
  readonly findings?: ContactFindings__Output;
  /** What was probably not meant about the contacts so far; `text` is a sentence, and `id` is stable. */
  readonly warnings: Warning[];
  /** Why the newest rejected contact was rejected. */
  readonly rejection?: CarillonError;
  /**
   * Sends a step. Await the promise, which gives the network a turn: a loop that never awaits anything sends nothing
   * before it ends, and of more than 4096 steps that wait the oldest are dropped (droppedStepCount). Throws
   * CarillonError if the stream has failed or has been closed (CONTACT_STREAM_ENDED), and if the time goes back, or is
   * over 1e10 s before or after 0 (INVALID_STREAM); such a step is not sent, and the stream can go on.
   */
  step(time: number, content?: StepContent): Promise<void>;
  /**
   * Waits until the daemon has taken all steps. Returns the last report. Unless `warn` is false, the process warns of
   * each fact in `warnings` by a ContactWarning, whose code is the id.
   */
  close(warn?: boolean): Promise<StreamContactsResponse__Output>;
}

/**
 * What the daemon plays, from the call of Client.listen on, by `take` or `for await`. It lasts until `stop`, the end of
 * such a loop, or `close` of the client.
 */
export class Recording {
  /**
   * Waits for the next seconds of the sound, and returns them: the first call from the beginning of the recording on, and
   * each further call from where the one before ended, without a gap.
   */
  take(seconds: number): Promise<Sound>;
  /** Yields the sound in blocks as they come, until the loop is left or the scene is deleted. */
  [Symbol.asyncIterator](): AsyncGenerator<Sound>;
  /** Frames that were lost so far, because the program did not read fast enough. */
  readonly lostFrameCount: number;
  /** Ends the recording. */
  stop(): Promise<void>;
}

export interface JobFilters {
  states?: Array<'queued' | 'running' | 'succeeded' | 'failed' | 'cancelled'>;
  /** Text that the label has, in upper or lower case. */
  labelContains?: string;
}

/** What a model is asked for with beside its material. */
export type ModelRequest = Omit<CreateModalModelRequest, 'material' | 'meshDigest' | 'meshFormat'> & {
  unit?: 'm' | 'cm' | 'mm' | 'in' | number; accuracy?: number; onProgress?: (job: Job__Output) => void;
};

/** A connection. */
export class Client {
  readonly server: string;
  /** Returns the version, the age, the limits and the features of the daemon. */
  info(): Promise<GetServerInfoResponse__Output>;
  status(): Promise<GetMixerResponse__Output>;
  /** Stores a mesh. Returns its digest. */
  upload(mesh: Mesh): Promise<string>;
  /**
   * Returns the model of a mesh, which is computed if the daemon does not have it. `unit` is that of its coordinates, by
   * name or in metres; `accuracy` the largest estimated error of a frequency, such as 0.01 for 1 %.
   */
  createModel(mesh: Mesh, request: ModelRequest & { material: Material }): Promise<Model>;
  /** The same with the name of a material before the rest. */
  createModel(mesh: Mesh, material: string, request?: ModelRequest): Promise<Model>;
  /** Returns the model that the text means: a name, a label, or the first digits of a digest. */
  model(text: string, material?: Material): Promise<Model>;
  models(filters?: ListModalModelsRequest): AsyncGenerator<Model>;
  /** Makes an empty scene, or returns the one that you made before with the same `id` and settings. */
  createScene(settings?: {
    hearing?: Hearing; listener?: Pose; gain?: number; keep?: boolean; id?: string;
  }): Promise<Scene>;
  /** Yields the jobs that match, newest first. */
  jobs(filters?: JobFilters): AsyncGenerator<Job__Output>;
  /** Yields the jobs that wait or run, then null, and then each job that matches after every change. */
  watchJobs(filters?: JobFilters): AsyncGenerator<Job__Output | null>;
  scenes(): Promise<Scene[]>;
  /** Renders a trace or a .contacts file. Throws CarillonError if a contact is rejected. */
  render(trace: Trace | string, settings?: RenderSettings): Promise<Sound>;
  /** Begins environments whose sound comes in step with their simulation. `step` is in seconds. */
  perform(settings: {
    step: number; environments?: number; microphones?: Microphone[]; latency?: number; frame?: 'object' | 'scene';
    pulseShape?: 'raised_cosine' | 'gaussian'; sampleRateHz?: number; fullScalePa?: number; hearing?: Hearing;
    tellImpacts?: boolean;
  }): Promise<Performance>;
  /** Begins to record what the daemon plays. Returns once it does. */
  listen(request?: ListenRequest): Promise<Recording>;
  /**
   * Changes the gain of the daemon's output, or mutes it, without a click. The gain is linear: 1 leaves the level as it
   * is, and 10 ** (x / 20) stands for x decibels.
   */
  setVolume(volume: { gain?: number; muted?: boolean }): Promise<UpdateMixerResponse__Output>;
  /** Fades out all that sounds in your scenes. Returns their number. */
  stopAll(): Promise<number>;
  /**
   * Calls a method of the contract that takes one message and answers one, such as "SceneService", "ListScenes". Throws a
   * TypeError for a method that has streams, such as Listen.
   */
  call(service: string, method: string, request: object): Promise<any>;
  /** Cancels streams that were not closed, recordings and renderings, and ends the connection after the other calls. */
  close(): void;
}

/** How a client knows a daemon over TCP, and the daemon the client. */
export interface ConnectOptions {
  /** The PEM file with the certificates that vouch for a daemon with TLS. */
  tlsRoots?: string;
  /** The token by which the daemon knows the caller. Default: $CARILLON_TOKEN. */
  token?: string;
  /** The PEM files of a client certificate, by which the daemon knows the caller; both or none. */
  tlsCertificate?: string;
  tlsKey?: string;
}
/** Connects to a daemon: "unix:PATH" or "HOST:PORT". Throws a TypeError if the options do not fit together. */
export function connect(server?: string, options?: ConnectOptions): Client;
/** The address where the daemon listens unless somebody says otherwise. */
export function defaultServer(): string;
