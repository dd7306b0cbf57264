// SPDX-License-Identifier: Apache-2.0
import { create } from '@bufbuild/protobuf';
import { ContactKind } from './gen/carillon/v1/contact_pb';
import { StreamContactsRequestSchema } from './gen/carillon/v1/contact_service_pb';
import type { StreamContactsRequest } from './gen/carillon/v1/contact_service_pb';
import { Outbox } from './outbox';
import type { Services } from './services';

type Triple = [number, number, number];

/** A contact stream whose strikes sound as soon as they arrive. */
export class StrikeStream {
  private readonly requests: Outbox<StreamContactsRequest>;

  /** `refused` gets the message of a strike that was rejected, `ended` is called when the daemon is lost. */
  constructor(services: Services, scene: string, refused: (message: string) => void, ended: () => void) {
    this.requests = new Outbox(create(StreamContactsRequestSchema, { start: { scene, stepS: 0.01, atOnce: true } }));
    void this.report(services, refused).catch(() => {}).then(ended);
  }

  /** Strikes an object at a point of its frame, m, with an impulse, N s. */
  send(object: number, point: Triple, impulse: Triple, striker: string): void {
    const vector = ([x, y, z]: Triple) => ({ x, y, z });
    this.requests.push(create(StreamContactsRequestSchema, { steps: [{ timeS: 0, contacts: [{
      kind: ContactKind.IMPACT, object,
      location: { case: 'pointM', value: vector(point) },
      action: { case: 'impulseNewtonSeconds', value: vector(impulse) },
      hertz: { striker },
    }] }] }));
  }

  private async report(services: Services, refused: (message: string) => void): Promise<void> {
    let rejected = 0n;
    for await (const report of services.contacts.streamContacts(this.requests)) {
      if (report.rejectedCount > rejected) refused(report.lastRejection?.message ?? '');
      rejected = report.rejectedCount;
    }
  }
}
