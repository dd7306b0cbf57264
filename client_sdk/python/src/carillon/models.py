# SPDX-License-Identifier: Apache-2.0
"""Modal models: the stored results of decompositions."""

from __future__ import annotations

import functools
import html
import time
from typing import TYPE_CHECKING, Any, Optional

import numpy

from carillon import checks, errors, jobs, materials, progress
from carillon.contacts import Array, Striker, strike_of
from carillon.sound import Sound
from carillon.traces import Trace
from carillon.v1 import modal_model_pb2, modal_model_service_pb2

if TYPE_CHECKING:
    from carillon.client import Client

NUMPY_TYPES = {modal_model_pb2.ELEMENT_TYPE_FLOAT32: "<f4", modal_model_pb2.ELEMENT_TYPE_FLOAT64: "<f8",
               modal_model_pb2.ELEMENT_TYPE_UINT32: "<u4"}


class Model:
    """A modal model in the daemon's database. `material` is the one that it was made with, the default of the methods
    below; None if it was imported. `summary` is the message that describes the model."""

    def __init__(self, client: Client, summary: modal_model_service_pb2.ModalModelSummary,
                 material: Optional[materials.Material] = None):
        self.client = client
        self.summary = summary
        self.material = summary.material if material is None and summary.HasField("material") else material

    @property
    def name(self) -> str:
        return self.summary.name

    @property
    def label(self) -> str:
        return self.summary.label

    @property
    def mode_count(self) -> int:
        return self.summary.header.mode_count

    @property
    def warnings(self) -> list[str]:
        """Facts that the user should know although they did not stop the decomposition."""
        return list(self.summary.header.warnings)

    @functools.cached_property
    def eigenvalues(self) -> numpy.ndarray:
        """Lambda of each mode for unit material, ascending."""
        if not self.summary.eigenvalues and self.mode_count:
            self.summary = self.client.model(self.name).summary
        return numpy.array(self.summary.eigenvalues)

    def modes(self, material: Optional[materials.Material] = None,
              size: float = 1) -> tuple[numpy.ndarray, numpy.ndarray]:
        """Returns the damped frequencies, Hz, and the decay rates, 1/s, of the modes by the material alone.
        `radiation_decays` has what radiation adds."""
        message = materials.named(self, material)[1]
        if message is None:
            raise errors.CarillonError("INVALID_MATERIAL", f"{self.name} was not made with a material here; give one, "
                                       "such as material=\"bell_bronze\"")
        return materials.modes_of(self.eigenvalues, self.client.resolve(message), size)

    def radiation_decays(self, material: Optional[materials.Material] = None, size: float = 1) -> numpy.ndarray:
        """Returns the decay rates of the modes by radiation, 1/s, which add to those of `modes`. They are zero if no
        stored transfer fits the material, as for an object that sounds by the paper's coupling."""
        message = materials.named(self, material)[1]
        if message is None:
            raise errors.CarillonError("INVALID_MATERIAL", f"{self.name} was not made with a material here; give one, "
                                       "such as material=\"bell_bronze\"")
        transfers = self.client.model(self.name).summary.transfers  # newer ones, too
        return materials.radiation_decays_of(self.eigenvalues, self.client.resolve(message), size, transfers)

    def frequencies(self, material: Optional[materials.Material] = None, size: float = 1) -> numpy.ndarray:
        """Returns the damped frequencies, Hz."""
        return self.modes(material, size)[0]

    @functools.cached_property
    def arrays(self) -> dict[str, numpy.ndarray]:
        """The arrays of the stored model by name, such as "vertices" (V x 3), "triangles" (T x 3) and "shapes"
        (V x 3 x modes); docs/model_format.md lists them."""
        request = modal_model_service_pb2.ExportModalModelRequest(name=self.name)
        header, pieces = modal_model_pb2.ModalModelHeader(), {}
        with errors.translated(self.client.server):
            answers = self.client.models_stub.ExportModalModel(request)
            with self.client.cancellable(answers):
                for answer in answers:
                    if answer.record.HasField("header"):
                        header = answer.record.header
                        pieces = {i: bytearray() for i in range(len(header.arrays))}
                    else:
                        pieces[answer.record.chunk.array] += answer.record.chunk.data
        return {array.name: numpy.frombuffer(bytes(pieces[i]), NUMPY_TYPES[array.type]).reshape(list(array.shape))
                for i, array in enumerate(header.arrays)}

    def render_strike(self, point: Array, impulse: Array, material: Optional[materials.Material] = None, *,
                      duration: Optional[float] = None, striker: Striker = None, size: float = 1, gain: float = 1,
                      seconds: float = 0, sample_rate_hz: int = 48000) -> Sound:
        """Renders one strike without a scene and faster than real time. The samples are the same each time once the
        transfer of the model is computed (wait_for_transfer). `duration` is that of the contact, in seconds; without it
        the `striker`, such as "wood", determines it. `gain` is a linear factor: 10 ** (x / 20) is x dB. `seconds`
        zero means until the sound has died away."""
        trace = Trace(simulator="carillon (Python)")
        body = trace.add(self, material, size=size, gain=gain)
        trace.step(0.0, impulses=strike_of(body, point, impulse, duration, striker))
        with errors.in_names(tail_s="seconds"):
            return self.client.render(trace, tail_s=seconds, sample_rate_hz=sample_rate_hz)

    def wait_for_transfer(self, timeout: Optional[float] = None, *, progress_bar: progress.Progress = None) -> None:
        """Waits until the daemon has computed how the model radiates, which it begins when the model is stored. Before
        that, objects sound by the paper's coupling, at other levels and without damping by radiation. Returns at once
        if no transfer of the model is being computed. Raises CarillonError if the computation failed, or if it has not
        ended after `timeout` seconds (DEADLINE_EXCEEDED)."""
        end_s = None if timeout is None else time.monotonic() + timeout
        for job in self._transfer_jobs():
            job.wait(progress_bar, None if end_s is None else max(0, end_s - time.monotonic()))
        self.summary = self.client.model(self.name).summary

    def _transfer_jobs(self) -> list[jobs.Job]:
        """The jobs whose end decides whether the model has a transfer: those that wait or run, or else the newest one
        that did not succeed, if no transfer is stored."""
        found = [job for job in self.client.jobs(["queued", "running", "failed", "cancelled"])
                 if job.is_transfer and job.message.modal_model == self.name]
        awaited = [job for job in found if job.state in ("queued", "running")]
        return awaited or ([] if self.client.model(self.name).summary.transfers else found[:1])

    def update(self, *, label: Optional[str] = None, add_tags: tuple[str, ...] = (),
               remove_tags: tuple[str, ...] = (), pinned: Optional[bool] = None) -> None:
        """Changes the label, the tags or the pin of the model."""
        request = modal_model_service_pb2.UpdateModalModelRequest(
            name=self.name, label=label, add_tags=add_tags, remove_tags=remove_tags)
        if pinned is not None:
            request.pinned = pinned
        with errors.translated(self.client.server):
            self.summary = self.client.models_stub.UpdateModalModel(request).modal_model

    def delete(self) -> None:
        """Deletes the model; objects that sound with it go on sounding."""
        with errors.translated(self.client.server):
            self.client.models_stub.DeleteModalModel(modal_model_service_pb2.DeleteModalModelRequest(name=self.name))

    def plot_modes(self, material: Optional[materials.Material] = None, axes: Any = None) -> Any:
        """Draws the frequencies of the modes and their couplings to the air; needs matplotlib. Returns its axes."""
        from carillon import plots
        return plots.plot_modes(self.frequencies(material), self.arrays["couplings"], axes)

    def plot_shape(self, mode: int, axes: Any = None) -> Any:
        """Draws the shape of one mode, counted from zero; needs matplotlib. Returns its axes."""
        from carillon import plots
        return plots.plot_shape(self.arrays, mode, axes)

    def __repr__(self) -> str:
        return f"<Model {self.label or self.name}: {checks.counted(self.mode_count, 'mode')}>"

    def _repr_html_(self) -> str:
        header = self.summary.header
        rows = {"model": self.name, "label": self.label, "modes": str(self.mode_count),
                "mesh": f"{header.node_count} nodes, {header.element_count} tetrahedra",
                "volume": f"{header.volume_m3:.6g} m³"}
        if self.material is not None and self.mode_count:
            low, high = self.frequencies()[[0, -1]]
            rows["frequencies"] = f"{low:.1f} to {high:.1f} Hz"
        rows |= {f"warning {i}": text for i, text in enumerate(self.warnings, start=1)}
        cells = "".join(f"<tr><th>{key}</th><td>{html.escape(value)}</td></tr>" for key, value in rows.items())
        return f"<table>{cells}</table>"
