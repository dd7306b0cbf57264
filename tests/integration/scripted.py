# SPDX-License-Identifier: Apache-2.0
"""A shell script in the place of carillon-precompute, and what it leaves behind."""

import contextlib
import itertools
import pathlib
import sqlite3
import subprocess

import meshes
import numpy
from carillon.v1 import decomposition_pb2, modal_model_pb2, transfer_pb2
from daemon import BIN
from google.protobuf.internal.decoder import _DecodeVarint32
from google.protobuf.internal.encoder import _VarintBytes

OPTIONS = r"""#!/bin/sh
here='{here}'
mesh=$1
for option; do
  case $option in
    --out=*) out=${{option#--out=}} ;;
    --request=*) request=${{option#--request=}} ;;
  esac
done
nodes=$(sed -n 's/^ *target_node_count: //p' "$request")
max_frequency_hz=$(sed -n 's/^ *max_frequency_hz: //p' "$request")
{body}
"""
# A transfer waits for the file `enough`, and fails if there is a file `fail`. The file `runs` has a line for each.
TRANSFERS_WAIT = f"""
if grep -q radiate_stored_model "$request"; then
  echo transfer >>"$here/runs"
  while [ ! -e "$here/enough" ]; do printf '\\002\\012\\000' >&3; sleep 0.05; done
  [ ! -e "$here/fail" ] || exit 1
fi
exec {BIN}/carillon-precompute "$@"
"""


def worker(folder, body):
    """A program for --precompute. Its script finds the mesh in $mesh, the file to write in $out, the
    number of nodes asked for in $nodes, the highest frequency asked for in $max_frequency_hz, and its
    own files in $here; descriptor 3 takes events."""
    path = pathlib.Path(folder) / "worker.sh"
    path.write_text(OPTIONS.format(here=folder, body=body))
    path.chmod(0o700)
    return path


def make_model(folder):
    """A file with the model of the bar."""
    mesh, model = pathlib.Path(folder) / "bar.obj", pathlib.Path(folder) / "bar.model"
    mesh.write_bytes(meshes.bar())
    subprocess.run([BIN / "carillon-precompute", mesh, "--material", meshes.MATERIAL, "--band", "20:20000",
                    "--out", model], check=True, capture_output=True)
    return model


def read_records(path):
    """The records of a model file."""
    data, at, records = path.read_bytes(), 0, []
    while at < len(data):
        size, at = _DecodeVarint32(data, at)
        records.append(modal_model_pb2.ModalModelRecord.FromString(data[at:at + size]))
        at += size
    return records


def arrays_of(header, chunks):
    """The arrays of a stored model or transfer by name (docs/model_format.md)."""
    types = {modal_model_pb2.ELEMENT_TYPE_FLOAT32: "<f4", modal_model_pb2.ELEMENT_TYPE_FLOAT64: "<f8",
             modal_model_pb2.ELEMENT_TYPE_UINT32: "<u4"}
    parts = {}
    for chunk in chunks:
        parts.setdefault(chunk.array, []).append(chunk.data)
    return {array.name: numpy.frombuffer(b"".join(parts.get(number, [])), types[array.type]).reshape(tuple(array.shape))
            for number, array in enumerate(header.arrays)}


def read_model(path):
    """(header, arrays) of a model's file."""
    first, *records = read_records(path)
    return first.header, arrays_of(first.header, [record.chunk for record in records if record.HasField("chunk")])


def read_transfer(path):
    """(header, arrays) of the first transfer in a file that `carillon model export` has written."""
    records = [transfer_pb2.TransferRecord.FromString(record.transfer) for record in read_records(path)
               if record.transfer]
    chunks = itertools.takewhile(lambda record: record.HasField("chunk"), records[1:])
    return records[0].header, arrays_of(records[0].header, [record.chunk for record in chunks])


def delimited(record):
    """A record as it stands in a file."""
    data = record.SerializeToString()
    return _VarintBytes(len(data)) + data


def stored(folder):
    """(models, revisions ever stored, jobs that did not succeed) in the database of the daemon in a folder."""
    with contextlib.closing(sqlite3.connect(folder / "data/carillon.db")) as database:
        return tuple(database.execute(f"SELECT {figure}").fetchone()[0] for figure in (
            "count(*) FROM models", "seq FROM sqlite_sequence WHERE name = 'models'",
            f"count(*) FROM jobs WHERE state != {decomposition_pb2.JOB_STATE_SUCCEEDED}"))


def processes_of(folder):
    """Numbers of the processes whose command line names something in the folder, but no zombies'."""
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                if str(folder).encode() in (entry / "cmdline").read_bytes():
                    found.append(int(entry.name))
            except OSError:
                pass  # it has ended meanwhile
    return found
