# SPDX-License-Identifier: Apache-2.0
"""Carillon's own programs for the analysis: sounds rendered by a private daemon."""

import contextlib
import dataclasses
import json
import os
import pathlib

import bench


def loss_factor(points):
    """A material's damping by pairs of Hz and eta, as the contract has it."""
    return {"alpha1_s": 0, "alpha2_per_s": 0,
            "loss_factor": [{"frequency_hz": hz, "loss_factor": eta} for hz, eta in points]}


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


class Studio:
    """A daemon that renders blows."""

    def __init__(self, daemon):
        self.daemon, self.folder = daemon, daemon.folder

    def command(self, *arguments):
        """What `carillon` prints."""
        return self.daemon.command(*arguments).stdout

    def decompose(self, mesh, out, *options):
        bench.decompose(pathlib.Path(os.environ["CARILLON_BUILD_DIR"]), mesh, out, *options)

    def import_model(self, path):
        """Stores a model file (.model or .npz); its name."""
        return json.loads(self.command("--json", "model", "import", path))["name"]

    def radiate(self, model, material, *options):
        """Computes how a stored model radiates."""
        figures = ["--young", material["young_pa"], "--density", material["density_kg_per_m3"], "--loss-factor", 1e-3]
        self.command("transfer", model.split("/")[-1], *figures, *options, "--wait")

    def export(self, model):
        """A file with a stored model and its transfers."""
        out = self.folder / "exported.model"
        self.command("model", "export", model.split("/")[-1], "--out", out)
        return out

    def render(self, heard, blows, tail_s):
        """What is heard of one body at 48 kHz: (samples, summary)."""
        import carillon
        import sound
        from carillon.v1 import contact_pb2, material_pb2

        trace = carillon.Trace(0.001, pulse_shape="gaussian" if heard.gaussian else None)
        laws = "paper_coupling" if heard.paper_coupling else "modes_only" if heard.modes_only else None
        trace.add(heard.model, material_pb2.Material(**heard.material), radiation=laws)
        trace.steps = [contact_pb2.ContactStep(time_s=blow.time_s, contacts=[blow.message()]) for blow in blows]
        contacts, out = self.folder / "trace.contacts", self.folder / "trace.wav"
        trace.write(contacts)
        summary = json.loads(self.command("--json", "render", contacts, "--out", out, "--sample-rate", sound.RATE,
                                          "--tail", tail_s))
        if int(summary.get("rejected_count", 0)):
            raise RuntimeError(f"an impulse was refused: {summary}")
        return sound.read_wave(out)[:, 0], summary


@contextlib.contextmanager
def studio():
    """A Studio in a folder of its own."""
    with bench.daemon() as daemon:
        yield Studio(daemon)
