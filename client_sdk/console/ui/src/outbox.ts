// SPDX-License-Identifier: Apache-2.0

/** The requests of a call that goes on as long as the page does. */
export class Outbox<T> {
  private readonly waiting: T[];
  private wake = () => {};

  constructor(...first: T[]) {
    this.waiting = first;
  }

  push(request: T): void {
    this.waiting.push(request);
    this.wake();
  }

  async* [Symbol.asyncIterator](): AsyncGenerator<T> {
    for (;;) {
      const next = this.waiting.shift();
      if (next) yield next;
      else await new Promise<void>((resolve) => { this.wake = resolve; });
    }
  }
}
