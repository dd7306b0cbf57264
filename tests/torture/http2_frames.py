# SPDX-License-Identifier: Apache-2.0
"""Frames of HTTP/2 (RFC 9113) and fields of HPACK (RFC 7541), byte by byte, for clients that no library would be."""

PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
HEADERS, RST_STREAM, SETTINGS, PING, CONTINUATION = 1, 3, 4, 6, 9
END_HEADERS = 4
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
