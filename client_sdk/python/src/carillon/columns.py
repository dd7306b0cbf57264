# SPDX-License-Identifier: Apache-2.0
"""Columns of numbers, put into a message as the bytes that protobuf writes: several times faster than number by number
from Python."""

from __future__ import annotations

from typing import Any

import numpy

LENGTH_DELIMITED = 2


def append(message: Any, **columns: numpy.ndarray) -> None:
    """Appends arrays to repeated fields of a message, by the names of the fields: of float, double or uint32."""
    fields = message.DESCRIPTOR.fields_by_name
    message.MergeFromString(b"".join(_packed(fields[name], values) for name, values in columns.items()))


def _packed(field: Any, values: numpy.ndarray) -> bytes:
    if field.type == field.TYPE_UINT32:
        data = varints(values)
    else:
        data = numpy.ascontiguousarray(values, "<f4" if field.type == field.TYPE_FLOAT else "<f8").tobytes()
    return varint(field.number << 3 | LENGTH_DELIMITED) + varint(len(data)) + data


def varint(number: int) -> bytes:
    """A number as protobuf writes it: seven bits a byte, the lowest first, and the eighth bit set in all but the
    last."""
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*out, number])


def varints(values: numpy.ndarray) -> bytes:
    """Numbers of at most 32 bits, each as a varint."""
    numbers = numpy.asarray(values, numpy.uint32)
    if not numbers.size or numbers.max() < 0x80:
        return numbers.astype(numpy.uint8).tobytes()
    shifted = numbers[:, None] >> numpy.arange(0, 35, 7, dtype=numpy.uint32)
    is_used = shifted != 0
    is_used[:, 0] = True
    continues = numpy.zeros_like(is_used)
    continues[:, :-1] = is_used[:, 1:]
    groups = (shifted & 0x7F) | (continues.astype(numpy.uint32) << 7)
    return groups[is_used].astype(numpy.uint8).tobytes()
