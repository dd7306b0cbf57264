# SPDX-License-Identifier: Apache-2.0
"""A shell script in the place of carillon-precompute, and what it leaves behind."""

import contextlib
import pathlib
import sqlite3
import subprocess

import meshes
from carillon.v1 import decomposition_pb2, modal_model_pb2
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
