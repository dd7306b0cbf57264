# SPDX-License-Identifier: Apache-2.0
"""Frames of HTTP/2 (RFC 9113) and fields of HPACK (RFC 7541), byte by byte, for clients that no library would be."""

import contextlib
import socket
import struct

PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
DATA, HEADERS, RST_STREAM, SETTINGS, PING, WINDOW_UPDATE, CONTINUATION = 0, 1, 3, 4, 6, 8, 9
END_HEADERS, ACK = 4, 1
INITIAL_WINDOW_SIZE = 4
CANCEL = 8
METHOD = b"/carillon.v1.AudioService/GetMixer"


def frame(kind, flags=0, stream=0, payload=b""):
    return len(payload).to_bytes(3, "big") + bytes((kind, flags)) + stream.to_bytes(4, "big") + payload


def length(number):
    """A length with a prefix of 7 bits (RFC 7541, 5.1)."""
    if number < 127:
        return bytes((number,))
    digits, number = [127], number - 127
    while number > 127:
        digits.append(0x80 | number & 0x7F)
        number >>= 7
    return bytes((*digits, number))


def field(name, value):
    """A header without compression, which is not remembered (RFC 7541, 6.2.2)."""
    return b"\0" + length(len(name)) + name + length(len(value)) + value


# The headers of a call.
CALL = b"".join(field(name, value) for name, value in (
    (b":method", b"POST"), (b":scheme", b"http"), (b":path", METHOD), (b":authority", b"localhost"),
    (b"te", b"trailers"), (b"content-type", b"application/grpc")))


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
