// SPDX-License-Identifier: Apache-2.0
// Calls of gRPC as bytes over one WebSocket; client_sdk/console/gateway/tunnel_frame.h describes the frames.

const OPEN = 0, MESSAGE = 1, HALF_CLOSE = 2, CANCEL = 3, END = 4;
const UNAVAILABLE = 14;
const HEAD_BYTES = 5;
const FIRST_DELAY_MS = 250, MOST_DELAY_MS = 2000;
const MOST_BUFFERED_BYTES = 4 << 20;

export interface CallHandlers {
  message(bytes: Uint8Array): void;
  /** Gets the gRPC status code, its message, and the bytes of grpc-status-details-bin. */
  end(code: number, text: string, details: Uint8Array): void;
}

export interface TunnelCall {
  send(bytes: Uint8Array): void;
  halfClose(): void;
  cancel(): void;
}

/** A tunnel to the daemon, which opens its socket again whenever it is lost; calls of a lost socket end UNAVAILABLE. */
export class Tunnel {
  private socket?: WebSocket;
  private readonly calls = new Map<number, CallHandlers>();
  private waiting: Uint8Array<ArrayBuffer>[] = [];
  private nextCall = 1;
  private delayMs = FIRST_DELAY_MS;

  constructor(private readonly address: string, private readonly stateChanged: (open: boolean) => void) {
    this.connect();
  }

  open(method: string, handlers: CallHandlers): TunnelCall {
    const call = this.nextCall++;
    this.calls.set(call, handlers);
    this.send(OPEN, call, new TextEncoder().encode(method));
    return {
      send: (bytes) => this.send(MESSAGE, call, bytes),
      halfClose: () => this.send(HALF_CLOSE, call),
      cancel: () => this.send(CANCEL, call),
    };
  }

  /** Resolves once the socket has taken most of what was sent. */
  async drained(): Promise<void> {
    while ((this.socket?.bufferedAmount ?? 0) > MOST_BUFFERED_BYTES) {
      await new Promise((resolve) => setTimeout(resolve, 5));
    }
  }

  private connect(): void {
    const socket = new WebSocket(this.address);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => {
      this.delayMs = FIRST_DELAY_MS;
      this.socket = socket;
      for (const frame of this.waiting.splice(0)) socket.send(frame);
      this.stateChanged(true);
    };
    socket.onmessage = (event) => this.take(new Uint8Array(event.data as ArrayBuffer));
    socket.onclose = () => {
      this.socket = undefined;
      this.waiting = [];
      const lost = [...this.calls.values()];
      this.calls.clear();
      this.stateChanged(false);
      for (const call of lost) call.end(UNAVAILABLE, 'the console is not reached', new Uint8Array());
      setTimeout(() => this.connect(), this.delayMs);
      this.delayMs = Math.min(2 * this.delayMs, MOST_DELAY_MS);
    };
  }

  private send(kind: number, call: number, body: Uint8Array = new Uint8Array()): void {
    if (!this.calls.has(call)) return;
    const frame = new Uint8Array(HEAD_BYTES + body.length);
    frame[0] = kind;
    new DataView(frame.buffer).setUint32(1, call, true);
    frame.set(body, HEAD_BYTES);
    if (this.socket) this.socket.send(frame);
    else this.waiting.push(frame);
  }

  private take(frame: Uint8Array): void {
    const view = new DataView(frame.buffer, frame.byteOffset, frame.byteLength);
    const call = view.getUint32(1, true);
    const handlers = this.calls.get(call);
    if (!handlers) return;
    if (frame[0] === MESSAGE) handlers.message(frame.subarray(HEAD_BYTES));
    if (frame[0] !== END) return;
    this.calls.delete(call);
    const textEnd = HEAD_BYTES + 8 + view.getUint32(HEAD_BYTES + 4, true);
    handlers.end(view.getUint32(HEAD_BYTES, true),
      new TextDecoder().decode(frame.subarray(HEAD_BYTES + 8, textEnd)), frame.subarray(textEnd));
  }
}

/** The address of the console's tunnel. */
export function tunnelAddress(): string {
  return `ws://${self.location.host}/tunnel`;
}
