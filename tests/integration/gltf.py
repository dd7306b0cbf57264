# SPDX-License-Identifier: Apache-2.0
"""glTF files with modal models, read and written without Carillon."""

import base64
import json
import struct

import numpy

EXTENSION = "KHR_audio_rigid_bodies"
INDEX = {"type": "integer", "minimum": 0}
POSITIVE = {"type": "number", "exclusiveMinimum": 0}
NOT_NEGATIVE = {"type": "number", "minimum": 0}

# What the draft demands of the fields that Carillon writes.
SCHEMA = {
    "type": "object",
    "required": ["asset", "extensionsUsed", "extensions", "nodes", "accessors"],
    "properties": {
        "asset": {"required": ["version"], "properties": {"version": {"const": "2.0"}}},
        "extensionsUsed": {"contains": {"const": EXTENSION}},
        "extensionsRequired": {"not": {"contains": {"const": EXTENSION}}},
        "extensions": {"required": [EXTENSION], "properties": {EXTENSION: {
            "type": "object",
            "properties": {
                "modalModels": {"type": "array", "minItems": 1, "items": {
                    "type": "object",
                    "required": ["frequencies", "decayRates", "positions", "shapes"],
                    "properties": {
                        **{name: INDEX for name in ("frequencies", "decayRates", "positions", "shapes",
                                                    "indices", "material")},
                        "name": {"type": "string"}, "extras": {"type": "object"}},
                    "additionalProperties": False}},
                "acousticMaterials": {"type": "array", "minItems": 1, "items": {
                    "type": "object",
                    "properties": {
                        "density": POSITIVE, "youngsModulus": POSITIVE,
                        "poissonRatio": {"type": "number", "exclusiveMinimum": -1,
                                         "exclusiveMaximum": 0.5},
                        "alpha": NOT_NEGATIVE, "beta": NOT_NEGATIVE, "name": {"type": "string"}},
                    "additionalProperties": False}}},
            "additionalProperties": False}}},
        "nodes": {"type": "array", "contains": {
            "required": ["extensions"], "properties": {"extensions": {
                "required": [EXTENSION], "properties": {EXTENSION: {
                    "type": "object", "required": ["modalModel"],
                    "properties": {"modalModel": INDEX, "gain": NOT_NEGATIVE},
                    "additionalProperties": False}}}}}},
        "accessors": {"type": "array", "items": {
            "required": ["bufferView", "componentType", "count", "type"],
            "properties": {"count": {"type": "integer", "minimum": 1}}}}}}


def write_binary(path, document, buffer):
    """Writes a binary file, which holds the buffer."""
    text = json.dumps(document | {"buffers": [{"byteLength": len(buffer)}]}).encode()
    text += b" " * (-len(text) % 4)
    path.write_bytes(struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(buffer), len(text), 0x4e4f534a) + text
                     + struct.pack("<II", len(buffer), 0x004e4942) + buffer)


def read(path):
    """(JSON, buffer) of a binary file, or of a text file with its buffer in a data URI."""
    data = path.read_bytes()
    if data[:4] != b"glTF":
        document = json.loads(data)
        return document, base64.b64decode(document["buffers"][0]["uri"].split(",", 1)[1])
    _, version, length, json_length, json_type = struct.unpack_from("<4sIIII", data)
    assert (version, length, json_type) == (2, len(data), 0x4e4f534a) and json_length % 4 == 0
    binary_length, binary_type = struct.unpack_from("<II", data, 20 + json_length)
    assert binary_type == 0x004e4942 and len(data) == 28 + json_length + binary_length
    return json.loads(data[20:20 + json_length]), data[28 + json_length:]


def array(document, buffer, index):
    """The numbers of an accessor."""
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    kind = {5123: "<u2", 5125: "<u4", 5126: "<f4"}[accessor["componentType"]]
    columns = {"SCALAR": 1, "VEC3": 3}[accessor["type"]]
    begin = view.get("byteOffset", 0)
    numbers = numpy.frombuffer(buffer[begin:begin + view["byteLength"]], kind,
                               accessor["count"] * columns)
    return numbers.reshape(-1, 3) if columns == 3 else numbers


class Writer:
    """Builds a file from arrays, as another program would."""

    def __init__(self):
        self.buffer = bytearray()
        self.views, self.accessors = [], []

    def add(self, numbers):
        """Returns the index of the accessor."""
        kind = {"f": 5126, "u": 5123}[numbers.dtype.kind]
        data = numbers.astype("<f4" if kind == 5126 else "<u2").tobytes()
        self.views.append({"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(data)})
        self.buffer += data + bytes(-len(data) % 4)
        self.accessors.append({
            "bufferView": len(self.views) - 1, "componentType": kind, "count": len(numbers),
            "type": f"VEC{numbers.shape[1]}" if numbers.ndim == 2 else "SCALAR"})
        if numbers.ndim == 2:
            self.accessors[-1] |= {"min": numbers.min(0).tolist(), "max": numbers.max(0).tolist()}
        return len(self.accessors) - 1

    def document(self, model, materials, mesh):
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.buffer).decode()
        return {
            "asset": {"version": "2.0", "generator": "a test"}, "extensionsUsed": [EXTENSION],
            "extensions": {EXTENSION: {"modalModels": [model], "acousticMaterials": materials}},
            "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "translation": [1, 2, 3], "rotation": [0, 0.6, 0, 0.8],
                       "extensions": {EXTENSION: {"modalModel": 0}}}],
            "meshes": [{"primitives": [mesh]}], "accessors": self.accessors,
            "bufferViews": self.views, "buffers": [{"byteLength": len(self.buffer), "uri": uri}]}
