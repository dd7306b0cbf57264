// SPDX-License-Identifier: Apache-2.0
// Connect's Transport over a Tunnel: every generated client works over it, with all four kinds of calls.
import { create, fromBinary, toBinary } from '@bufbuild/protobuf';
import type { DescMessage, DescMethod, DescMethodStreaming, DescMethodUnary, MessageInitShape, MessageShape } from '@bufbuild/protobuf';
import { BinaryReader, WireType } from '@bufbuild/protobuf/wire';
import { Code, ConnectError, createClient } from '@connectrpc/connect';
import type { Client, StreamResponse, Transport, UnaryResponse } from '@connectrpc/connect';
import type { DescService } from '@bufbuild/protobuf';
import { ErrorInfoSchema } from './gen/carillon/v1/error_pb';
import type { ErrorInfo } from './gen/carillon/v1/error_pb';
import type { Tunnel } from './tunnel';

/** The ErrorInfo within a google.rpc.Status, whose field 3 has details as Any (type_url 1, value 2). */
function infoOf(details: Uint8Array): { type: string; value: Uint8Array }[] {
  const found: { type: string; value: Uint8Array }[] = [];
  const status = new BinaryReader(details);
  while (status.pos < status.len) {
    const [field, wire] = status.tag();
    if (field !== 3 || wire !== WireType.LengthDelimited) {
      status.skip(wire, field);
      continue;
    }
    const any = new BinaryReader(status.bytes());
    const one = { type: '', value: new Uint8Array() as Uint8Array };
    while (any.pos < any.len) {
      const [inner, innerWire] = any.tag();
      if (inner === 1) one.type = any.string().replace(/^.*\//, '');
      else if (inner === 2) one.value = any.bytes();
      else any.skip(innerWire, inner);
    }
    found.push(one);
  }
  return found;
}

function errorOf(code: number, text: string, details: Uint8Array): ConnectError {
  const error = new ConnectError(text, code as Code);
  error.details = infoOf(details);
  return error;
}

/** The daemon's own words of a refusal, with its reason and remedies; undefined for other errors. */
export function errorInfo(error: unknown): ErrorInfo | undefined {
  return ConnectError.from(error).findDetails(ErrorInfoSchema)[0];
}

async function* messagesOf<O extends DescMessage>(tunnel: Tunnel, method: DescMethod & { output: O },
    input: AsyncIterable<MessageInitShape<DescMessage>>, signal?: AbortSignal): AsyncGenerator<MessageShape<O>> {
  const received: Uint8Array[] = [];
  let ended: ConnectError | 'well' | undefined;
  let wake = () => {};
  const call = tunnel.open(`/${method.parent.typeName}/${method.name}`, {
    message: (bytes) => { received.push(bytes); wake(); },
    end: (code, text, details) => { ended = code ? errorOf(code, text, details) : 'well'; wake(); },
  });
  signal?.addEventListener('abort', () => call.cancel());
  const sending = (async () => {
    for await (const message of input) {
      call.send(toBinary(method.input, create(method.input, message)));
      await tunnel.drained();
    }
    call.halfClose();
  })();
  sending.catch(() => call.cancel());
  try {
    for (;;) {
      const next = received.shift();
      if (next) yield fromBinary(method.output, next);
      else if (ended === 'well') return;
      else if (ended) throw ended;
      else await new Promise<void>((resolve) => { wake = resolve; });
    }
  } finally {
    if (!ended) call.cancel();
  }
}

async function* once<T>(value: T): AsyncGenerator<T> {
  yield value;
}

export function makeTransport(tunnel: Tunnel): Transport {
  return {
    async unary<I extends DescMessage, O extends DescMessage>(method: DescMethodUnary<I, O>, signal: AbortSignal | undefined,
        _timeout: number | undefined, _header: HeadersInit | undefined, input: MessageInitShape<I>): Promise<UnaryResponse<I, O>> {
      for await (const message of messagesOf<O>(tunnel, method, once(input), signal)) {
        return { stream: false, service: method.parent, method, header: new Headers(), trailer: new Headers(), message };
      }
      throw new ConnectError('the call ended without an answer', Code.Internal);
    },
    async stream<I extends DescMessage, O extends DescMessage>(method: DescMethodStreaming<I, O>,
        signal: AbortSignal | undefined, _timeout: number | undefined, _header: HeadersInit | undefined,
        input: AsyncIterable<MessageInitShape<I>>): Promise<StreamResponse<I, O>> {
      return { stream: true, service: method.parent, method, header: new Headers(), trailer: new Headers(),
        message: messagesOf<O>(tunnel, method, input, signal) };
    },
  };
}

export function clientOf<S extends DescService>(service: S, tunnel: Tunnel): Client<S> {
  return createClient(service, makeTransport(tunnel));
}
