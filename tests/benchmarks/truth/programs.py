# SPDX-License-Identifier: Apache-2.0
"""Carillon's own programs for the analysis: decompositions, and sounds rendered by a private daemon."""

import dataclasses
import json
import pathlib
import subprocess
import sys

import catalogue

sys.dont_write_bytecode = True


def use(build):
    """Takes the contract in Python from a build folder, and the programs too. To be called before all else here."""
    import os

    build = pathlib.Path(build).resolve()
    os.environ["CARILLON_BIN_DIR"] = str(build / "bin")
    sys.path[:0] = [str(build / "client_sdk/python"), str(catalogue.ROOT / "tests/integration"),
                    str(catalogue.ROOT / "tests/benchmarks/decomposition"),
                    str(catalogue.ROOT / "client_sdk/python")]


def decompose(mesh, out, *options):
    """Runs carillon-precompute; its JSON report."""
    import daemon

    command = [daemon.BIN / "carillon-precompute", mesh, "--out", out, "--json", *options]
    return json.loads(subprocess.run(list(map(str, command)), check=True, capture_output=True, text=True).stdout)


def loss_factor(points):
    """A material's damping by pairs of Hz and eta, as the contract has it."""
    return {"alpha1_s": 0, "alpha2_per_s": 0,
            "loss_factor": [{"frequency_hz": hz, "loss_factor": eta} for hz, eta in points]}


def knows(file, message, field):
    """Whether the contract has a field; commits before it lack what it stands for."""
    import importlib

    described = getattr(importlib.import_module(f"carillon.v1.{file}_pb2"), message).DESCRIPTOR
    return field in described.fields_by_name


def write_trace(path, header, objects, steps):
    """A contact trace: each record after its length."""
    from carillon.v1 import contact_trace_pb2
    from google.protobuf.internal.encoder import _VarintBytes

    record = contact_trace_pb2.ContactTraceRecord
    records = [record(header=header), *(record(object=item) for item in objects),
               *(record(step=step) for step in steps)]
    with open(path, "wb") as out:
        for item in map(record.SerializeToString, records):
            out.write(_VarintBytes(len(item)) + item)


@dataclasses.dataclass
class Blow:
    """One strike of a body, at a point in its own frame."""

    point_m: tuple
    impulse_newton_seconds: tuple
    duration_s: float = None  # None: the daemon's own choice, from the figures of the collision
    time_s: float = 0.0
    collision: dict = dataclasses.field(default_factory=dict)  # fields of HertzContact

    def message(self):
        import sound

        impulse = sound.impulse(self.point_m, self.impulse_newton_seconds)
        impulse.ClearField("duration_s")
        if self.duration_s is not None:
            impulse.duration_s = self.duration_s
        for name, figure in self.collision.items():
            setattr(impulse.hertz, name, figure)
        return impulse


@dataclasses.dataclass
class Heard:
    """A body, and by which laws it sounds."""

    model: str  # the daemon's name
    material: dict  # fields of the contract
    paper_coupling: bool = True
    gaussian: bool = True  # the shape of a contact's force
    modes_only: bool = False  # without the sound of the body's acceleration

    def message(self):
        from carillon.v1 import contact_trace_pb2, material_pb2

        body = contact_trace_pb2.ContactTraceObject(handle=1, modal_model=self.model,
                                                    material=material_pb2.Material(**self.material))
        if self.paper_coupling and knows("contact_trace", "ContactTraceObject", "radiation"):
            from carillon.v1 import radiation_pb2

            body.radiation = radiation_pb2.RADIATION_MODEL_PAPER_COUPLING
        elif self.modes_only:
            from carillon.v1 import radiation_pb2

            body.radiation = radiation_pb2.RADIATION_MODEL_MODES_ONLY
        return body


class Studio:
    """A daemon in a folder of its own that renders blows."""

    def __init__(self, folder, programs=None):
        """`programs`: the folder of the daemon's programs where they are not those of the build."""
        import daemon

        own, daemon.BIN = daemon.BIN, pathlib.Path(programs or daemon.BIN)
        self.daemon = daemon.Daemon(folder)
        self.programs, daemon.BIN = daemon.BIN, own

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.daemon.stop()

    def command(self, *arguments):
        """What `carillon` prints."""
        return subprocess.run([self.programs / "carillon", "--server", self.daemon.server, *map(str, arguments)],
                              check=True, capture_output=True, text=True).stdout

    def import_model(self, path):
        """Stores a model file (.model or .npz); its name."""
        return json.loads(self.command("--json", "model", "import", path))["name"]

    def radiate(self, model, material, *options):
        """Computes how a stored model radiates; False where the programs cannot."""
        if not knows("contact_trace", "ContactTraceObject", "radiation"):
            return False
        figures = ["--young", material["young_pa"], "--density", material["density_kg_per_m3"], "--loss-factor", 1e-3]
        self.command("transfer", model.split("/")[-1], *figures, *options, "--wait")
        return True

    def export(self, model):
        """A file with a stored model and its transfers."""
        out = self.daemon.folder / "exported.model"
        self.command("model", "export", model.split("/")[-1], "--out", out)
        return out

    def render(self, heard, blows, tail_s):
        """What is heard of one body at 48 kHz: (samples, summary)."""
        import sound
        from carillon.v1 import contact_pb2, contact_trace_pb2

        header = contact_trace_pb2.ContactTraceHeader(format_version=1, simulator="truth", step_s=0.001)
        if heard.gaussian and knows("contact_trace", "ContactTraceHeader", "pulse_shape"):
            header.pulse_shape = contact_pb2.PULSE_SHAPE_GAUSSIAN
        steps = [contact_pb2.ContactStep(time_s=blow.time_s, contacts=[blow.message()]) for blow in blows]
        trace, out = self.daemon.folder / "trace.contacts", self.daemon.folder / "trace.wav"
        write_trace(trace, header, [heard.message()], steps)
        summary = json.loads(self.command("--json", "render", trace, "--out", out, "--sample-rate", sound.RATE,
                                          "--tail", tail_s))
        if int(summary.get("rejected_count", 0)):
            raise RuntimeError(f"an impulse was refused: {summary}")
        return sound.read_wave(out)[:, 0], summary
