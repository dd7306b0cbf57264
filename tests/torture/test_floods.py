# SPDX-License-Identifier: Apache-2.0
"""Clients that flood the daemon with calls, headers, messages or connections, most of them without a credential.

The daemon's memory stays within bounds and comes back, and clients that do none of that are served meanwhile.
"""

import contextlib
import multiprocessing
import resource
import socket
import statistics
import struct
import threading
import time

import grpc
import hpack

import torture
from carillon.v1 import audio_service_pb2
from daemon import resident_mib, wait_until

CONNECTIONS = 4
RUN_S = torture.rounds(2.0, 20.0)
# The bound on a machine that does nothing else. Otherwise a test must only end.
P99_S = 0.05 if torture.LONG else 10.0
# What the calls, frames and headers take that have come before the daemon looks at the connection.
GROWTH_MIB = 256
LEFT_MIB = 16
# The daemon gives freed memory back every 5 s; some of it is in use until the connections have ended.
REST_S = 60

MOST_STREAM_ID = 2**31 - 1
FRAMES_AT_ONCE = 200

# Frames of HTTP/2 (RFC 9113), byte by byte, for clients that no library would be.
PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
DATA, HEADERS, RST_STREAM, SETTINGS, PING, WINDOW_UPDATE, CONTINUATION = 0, 1, 3, 4, 6, 8, 9
END_HEADERS, ACK = 4, 1
INITIAL_WINDOW_SIZE = 4
CANCEL = 8
METHOD = b"/carillon.v1.AudioService/GetMixer"


def frame(kind, flags=0, stream=0, payload=b""):
    return len(payload).to_bytes(3, "big") + bytes((kind, flags)) + stream.to_bytes(4, "big") + payload


def fields(*headers):
    """Headers without compression, which are not remembered (RFC 7541, 6.2.3)."""
    return hpack.Encoder().encode([hpack.NeverIndexedHeaderTuple(*header) for header in headers], huffman=False)


# The headers of a call.
CALL = fields((b":method", b"POST"), (b":scheme", b"http"), (b":path", METHOD), (b":authority", b"localhost"),
              (b"te", b"trailers"), (b"content-type", b"application/grpc"))


class Windows:
    """How many bytes a connection (stream 0) and each of its streams may still send, as the server has said."""

    def __init__(self, connection):
        self.connection = connection
        self.received = b""
        self.initial = 65535
        self.left = {0: 65535}

    def open(self, stream):
        self.left[stream] = self.initial

    def read(self):
        """Takes what has come. Returns false when the server has closed the connection."""
        with contextlib.suppress(BlockingIOError):
            while True:
                more = self.connection.recv(1 << 16, socket.MSG_DONTWAIT)
                if not more:
                    return False
                self.received += more
        while len(self.received) >= 9 + (size := int.from_bytes(self.received[:3], "big")):
            kind, flags = self.received[3:5]
            stream = int.from_bytes(self.received[5:9], "big")
            self._take(kind, flags, stream, self.received[9:9 + size])
            self.received = self.received[9 + size:]
        return True

    def _take(self, kind, flags, stream, payload):
        if kind == WINDOW_UPDATE and stream in self.left:
            self.left[stream] += int.from_bytes(payload, "big")
        elif kind == PING and not flags & ACK:
            self.connection.sendall(frame(PING, ACK, 0, payload))
        elif kind == SETTINGS and not flags & ACK:
            for name, value in struct.iter_unpack(">HI", payload):
                if name == INITIAL_WINDOW_SIZE:
                    self.left = {at: left + (value - self.initial if at else 0) for at, left in self.left.items()}
                    self.initial = value
            self.connection.sendall(frame(SETTINGS, ACK))
        elif kind == RST_STREAM or (kind == HEADERS and flags & 1):
            self.left.pop(stream, None)  # the server has ended the call


def resets(stream):
    """A call that is cancelled before its message."""
    return frame(HEADERS, END_HEADERS, stream, CALL) + frame(RST_STREAM, 0, stream, struct.pack(">I", CANCEL))


def unfinished(stream):
    """A call that waits for its message for ever."""
    return frame(HEADERS, END_HEADERS, stream, CALL)


def pings(_):
    return frame(PING, 0, 0, b"12345678")


class Flood:
    """Connections that send frames as fast as the daemon takes them, and read all answers, or none at all. A connection
    that the daemon closes is made again."""

    def __init__(self, path, make, reads=True):
        self.path = path
        self.make = make
        self.reads = reads
        self.stopped = False
        self.frames = 0
        self.lock = threading.Lock()
        self.threads = [threading.Thread(target=self._run) for _ in range(CONNECTIONS)]
        for thread in self.threads:
            thread.start()

    def _run(self):
        while not self.stopped:
            with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
                # A timeout of Python's own would let each read wait for it.
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, struct.pack("ll", 1, 0))
                connection.connect(self.path)
                self._send(connection)
            time.sleep(0.01)

    def _send(self, connection):
        connection.sendall(PREFACE + frame(SETTINGS))
        stream = 1
        while not self.stopped and stream < MOST_STREAM_ID - 2 * FRAMES_AT_ONCE:
            connection.sendall(b"".join(self.make(stream + 2 * i) for i in range(FRAMES_AT_ONCE)))
            stream += 2 * FRAMES_AT_ONCE
            with self.lock:
                self.frames += FRAMES_AT_ONCE
            with contextlib.suppress(BlockingIOError):
                while self.reads and connection.recv(1 << 16, socket.MSG_DONTWAIT):
                    pass

    def stop(self):
        self.stopped = True
        for thread in self.threads:
            thread.join()


class FloodTest(torture.ServedTest):
    def attack(self, make, reads=True):
        """The daemon's log, after a flood over the Unix socket amid which a good client calls."""
        self.serve()
        channel = grpc.insecure_channel(self.daemon.server, [("grpc.use_local_subchannel_pool", 1)])
        self.addCleanup(channel.close)
        call = channel.unary_unary(METHOD.decode(), audio_service_pb2.GetMixerRequest.SerializeToString,
                                   audio_service_pb2.GetMixerResponse.FromString)
        self.calls(call, 0.5)
        before_mib = resident_mib(self.daemon.process)
        flood = Flood(str(self.folder / "socket"), make, reads)
        try:
            amid, most_mib = self.calls(call, RUN_S)
        finally:
            flood.stop()
        rest_s = wait_until(lambda: resident_mib(self.daemon.process) < before_mib + LEFT_MIB, REST_S)
        p99_s = statistics.quantiles(amid, n=100)[98]
        print(f"{make.__name__}: {flood.frames} in {RUN_S:g} s; p99 of a good call {1e3 * p99_s:.1f} ms; "
              f"{before_mib:.1f} MiB before, at most {most_mib:.1f}, back after {rest_s:.0f} s", flush=True)
        self.assertGreater(flood.frames, 0)
        self.assertLess(p99_s, P99_S)
        self.assertLess(most_mib, before_mib + GROWTH_MIB)
        return self.daemon.log()

    def test_calls_that_are_cancelled_at_once(self):
        self.assertRegex(self.attack(resets),
                         "closed . connections of unix:pid-.* and refuses new ones for 30 s: it has")

    def test_calls_that_never_send_their_message(self):
        self.assertIn("open calls on", self.attack(unfinished))

    def test_pings_whose_answers_nobody_reads(self):
        self.attack(pings, reads=False)


class StrangerTest(torture.ServedTest):
    """Floods over TCP, of a client without a credential, while a simulator strikes over the Unix socket."""

    def setUp(self):
        super().setUp()
        access = self.folder / "access"
        access.touch(0o600)
        access.write_text("console administer certificate:console\n", encoding="utf-8")
        self.serve("--listen", "127.0.0.1:0", "--access-file", str(access))
        self.port = int(self.daemon.listening[-1].rpartition(":")[2])
        self.scene = torture.SoundingScene(self.daemon)
        self.addCleanup(self.scene.stop)
        wait_until(lambda: self.scene.answer.accepted_count > 0, 30)

    def attack(self, send, most_bytes, line):
        """`send(connection)` sends some bytes, and returns how many, until the daemon closes the connection, and logs
        the line. Returns the number of bytes."""
        before_mib, most_mib, sent = resident_mib(self.daemon.process), 0.0, 0
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port)) as connection:
            # A timeout of Python's own would let each read wait for it.
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, struct.pack("ll", 30, 0))
            connection.sendall(PREFACE + frame(SETTINGS))
            while sent < most_bytes:
                sent += send(connection)
                most_mib = max(most_mib, resident_mib(self.daemon.process) - before_mib)
        wait_until(lambda: line in self.daemon.log(), 10)
        print(f"{sent >> 20} MiB sent, at most {most_mib:.0f} MiB more", flush=True)
        self.assertLess(most_mib, GROWTH_MIB)
        begun = self.scene.answer.accepted_count
        wait_until(lambda: self.scene.answer.accepted_count > begun, 30)
        self.assertTrue(all(thread.is_alive() for thread in self.scene.threads), "the simulator's stream was ended")
        self.assertEqual(self.scene.answer.dropped_count, 0)
        return sent

    def test_headers_without_an_end(self):
        more = 16 * frame(CONTINUATION, 0, 1, fields((b"x-more", bytes(7000))))
        begin = [frame(HEADERS, 0, 1, fields((b":method", b"POST")))]

        def send(connection):
            part = begin.pop() if begin else more
            connection.sendall(part)
            return len(part)
        sent = self.attack(send, 512 << 20, "headers without an end")
        # The daemon allows 36 MiB; some are on their way meanwhile, in the buffers of the kernel.
        self.assertLess(sent, 256 << 20)

    def unfinished_messages(self, call_count, frame_bytes, most_bytes):
        """A call never gets the last byte of its message of 2 MiB."""
        windows, left = None, {}

        def send(connection):
            nonlocal windows
            if windows is None:
                windows = Windows(connection)
                for stream in range(1, 2 * call_count, 2):
                    windows.open(stream)
                    left[stream] = (2 << 20) - 1
                    connection.sendall(frame(HEADERS, END_HEADERS, stream, CALL)
                                       + frame(DATA, 0, stream, b"\0" + (2 << 20).to_bytes(4, "big")))
                    windows.left[stream] -= 5
                    windows.left[0] -= 5
            if not windows.read():
                raise OSError
            sent = 0
            for stream in [stream for stream in windows.left if stream]:
                frames = min(left[stream], windows.left[stream], windows.left[0], 1 << 14) // frame_bytes
                part = frame(DATA, 0, stream, bytes(frame_bytes)) * frames
                connection.sendall(part)
                left[stream] -= frames * frame_bytes
                windows.left[stream] -= frames * frame_bytes
                windows.left[0] -= frames * frame_bytes
                sent += len(part)
            if sent == 0:
                time.sleep(0.001)
            return sent or 1
        self.attack(send, most_bytes, "messages in tiny frames")

    def test_messages_in_frames_of_one_byte(self):
        self.unfinished_messages(40, 1, 104 << 20)

    def test_messages_without_their_last_byte(self):
        self.unfinished_messages(200, 1 << 13, 200 << 20)


def connect(path):
    """A connection that has begun 250 calls."""
    connection = socket.socket(socket.AF_UNIX)
    connection.settimeout(1)
    connection.connect(path)
    connection.sendall(PREFACE + frame(SETTINGS)
                       + b"".join(frame(HEADERS, END_HEADERS, 1 + 2 * i, CALL) for i in range(250)))
    return connection


def begin_and_leave(path, ended):
    while not ended.is_set():
        with contextlib.suppress(OSError):
            connect(path).close()


def begin_and_stay(path, ended):
    held = []
    for _ in range(100):
        with contextlib.suppress(OSError):
            held.append(connect(path))
    ended.wait()


def say_nothing(path, ended):
    held = []
    for _ in range(1000):
        held.append(socket.socket(socket.AF_UNIX))
        held[-1].settimeout(1)
        with contextlib.suppress(OSError):
            held[-1].connect(path)
    ended.wait()


class ConnectionTest(torture.ServedTest):
    """Another process that makes many connections."""

    def attacked(self, attack, line, prefix=()):
        self.serve(prefix=prefix)
        context = multiprocessing.get_context("spawn")
        ended = context.Event()
        attacker = context.Process(target=attack, args=(str(self.folder / "socket"), ended), daemon=True)
        attacker.start()
        self.addCleanup(attacker.join)
        self.addCleanup(ended.set)
        noticed_s = wait_until(lambda: line in self.daemon.log(), 60)
        # The kernel may refuse a first connection, because the attacker's fill the queue.
        self.client.audio.GetMixer(audio_service_pb2.GetMixerRequest(), timeout=60, wait_for_ready=True)
        times, most_mib = self.calls(self.client.audio.GetMixer, RUN_S)
        print(f"{attack.__name__}: noticed after {noticed_s:.1f} s, then at most {max(times):.2f} s a call, "
              f"{most_mib:.0f} MiB", flush=True)
        self.assertLess(max(times), P99_S if not torture.LONG else 2)

    def test_calls_that_are_left_on_ever_new_connections(self):
        self.attacked(begin_and_leave, "and refuses new ones")

    def test_calls_that_are_held_on_many_connections(self):
        self.attacked(begin_and_stay, "open calls on")

    def test_one_process_cannot_take_all_connections(self):
        self.attacked(say_nothing, "its share (--client-share)", prefix=("prlimit", "--nofile=1024:1024"))

    def test_a_call_without_a_place_is_told_why(self):
        self.serve(prefix=("prlimit", "--nofile=512:512"))
        with contextlib.ExitStack() as silent:
            for _ in range(64):  # half of the places, the share of this process
                silent.enter_context(socket.socket(socket.AF_UNIX)).connect(str(self.folder / "socket"))
            with self.assertRaises(grpc.RpcError) as refused:
                self.client.audio.GetMixer(audio_service_pb2.GetMixerRequest(), timeout=20)
            self.assertEqual(refused.exception.code(), grpc.StatusCode.RESOURCE_EXHAUSTED)
            self.assertRegex(refused.exception.details(), r"^TOO_MANY_CONNECTIONS: .* its share \(--client-share\)")

    def test_connections_are_accepted_again_when_silent_ones_have_ended(self):
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 4096), hard))
        self.addCleanup(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        self.serve("--listen", "127.0.0.1:0", prefix=("prlimit", "--nofile=1024:1024"))
        port = int(self.daemon.listening[1].rpartition(":")[2])
        with contextlib.ExitStack() as silent:
            for _ in range(1100):
                connection = silent.enter_context(socket.socket())
                connection.settimeout(2)
                with contextlib.suppress(OSError):
                    connection.connect(("127.0.0.1", port))
        with grpc.insecure_channel(f"127.0.0.1:{port}") as channel:
            again = channel.unary_unary(METHOD.decode())
            again(b"", timeout=30, wait_for_ready=True)
