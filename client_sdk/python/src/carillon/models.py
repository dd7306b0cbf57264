# SPDX-License-Identifier: Apache-2.0
"""Modal models: the stored results of decompositions."""

from __future__ import annotations

import functools
import html
import time
from collections.abc import AsyncGenerator, Mapping
from typing import Any, Optional, TypeVar

import numpy

from carillon import checks, errors, job_calls, materials, progress, rendering
from carillon.connection import Connection
from carillon.contacts import Array, Striker, strike_of
from carillon.faces import Awaited, Blocking, call, finished
from carillon.sound import Sound
from carillon.traces import Trace
from carillon.v1 import decomposition_pb2, modal_model_pb2, modal_model_service_pb2

NUMPY_TYPES = {modal_model_pb2.ELEMENT_TYPE_FLOAT32: "<f4", modal_model_pb2.ELEMENT_TYPE_FLOAT64: "<f8",
               modal_model_pb2.ELEMENT_TYPE_UINT32: "<u4"}
PREFIX = "modalModels/"


class ModelCalls:
    """A modal model in the daemon's database. `material` is the one that it was made with, the default of the methods
    below; None if it was imported. `summary` is the message that describes the model."""

    def __init__(self, client: Connection, summary: modal_model_service_pb2.ModalModelSummary,
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

    async def _eigenvalues(self) -> numpy.ndarray:
        if not self.summary.eigenvalues and self.mode_count:
            self.summary = await get(self.client, self.name)
        return numpy.array(self.summary.eigenvalues)

    async def _arrays(self) -> dict[str, numpy.ndarray]:
        request = modal_model_service_pb2.ExportModalModelRequest(name=self.name)
        header, pieces = modal_model_pb2.ModalModelHeader(), {}
        async for answer in self.client.answers(self.client.models_stub.ExportModalModel, request):
            if answer.record.HasField("header"):
                header = answer.record.header
                pieces = {i: bytearray() for i in range(len(header.arrays))}
            else:
                pieces[answer.record.chunk.array] += answer.record.chunk.data
        return {array.name: numpy.frombuffer(bytes(pieces[i]), NUMPY_TYPES[array.type]).reshape(list(array.shape))
                for i, array in enumerate(header.arrays)}

    async def _figures(self, material: Optional[materials.Material]) -> Any:
        """The figures of a material, or of the one that the model was made with."""
        message = materials.named(self, material)[1]
        if message is None:
            raise errors.CarillonError("INVALID_MATERIAL", f"{self.name} was not made with a material here; give one, "
                                       "such as material=\"bell_bronze\"")
        resolved = await materials.resolve(self.client, message)
        return materials.matched(resolved, self.summary.header.regions, await materials.catalogue(self.client))

    @call
    async def modes(self, material: Optional[materials.Material] = None,
                    size: float = 1) -> tuple[numpy.ndarray, numpy.ndarray]:
        """Returns the damped frequencies, Hz, and the decay rates, 1/s, of the modes by the material alone.
        `radiation_decays` has what radiation adds."""
        figures = await self._figures(material)
        return materials.modes_of(await self._eigenvalues(), figures, size, self.summary.header.regions)

    @call
    async def frequencies(self, material: Optional[materials.Material] = None, size: float = 1) -> numpy.ndarray:
        """Returns the damped frequencies, Hz."""
        return (await ModelCalls.modes(self, material, size))[0]

    @call
    async def radiation_decays(self, material: Optional[materials.Material] = None, size: float = 1) -> numpy.ndarray:
        """Returns the decay rates of the modes by radiation, 1/s, which add to those of `modes`. They are zero if no
        stored transfer fits the material, as for an object that sounds by the paper's coupling."""
        figures = await self._figures(material)
        transfers = (await get(self.client, self.name)).transfers  # newer ones, too
        return materials.radiation_decays_of(await self._eigenvalues(), figures, size, transfers)

    @call
    async def render_strike(self, point: Array, impulse: Array, material: Optional[materials.Material] = None, *,
                            duration: Optional[float] = None, striker: Striker = None, size: float = 1, gain: float = 1,
                            seconds: float = 0, sample_rate_hz: int = 48000) -> Sound:
        """Renders one strike without a scene and faster than real time. The samples are the same each time once the
        transfer of the model is computed (wait_for_transfer). `duration` is that of the contact, in seconds; without it
        the `striker`, such as "wood", determines it. `gain` is a linear factor: 10 ** (x / 20) is x dB. `seconds`
        zero means until the sound is 60 dB below its peak, and 60 s at most. The last 10 ms fade out."""
        trace = Trace(simulator="carillon (Python)")
        body = trace.add(self, material, size=size, gain=gain)
        trace.step(0.0, impacts=strike_of(body, point, impulse, duration, striker))
        settings = {"tail_s": seconds, "sample_rate_hz": sample_rate_hz}
        return await rendering.render(self.client, trace, settings)

    @call
    async def wait_for_transfer(self, timeout: Optional[float] = None, *,
                                progress_bar: progress.Progress = None) -> None:
        """Waits until the daemon has computed how the model radiates, which it begins when the model is stored. Before
        that, objects sound by the paper's coupling, at other levels and without damping by radiation. Returns at once
        if no transfer of the model is being computed. Raises CarillonError if the computation failed, or if it has not
        ended after `timeout` seconds (DEADLINE_EXCEEDED). `progress_bar` as for Job.wait."""
        end_s = None if timeout is None else time.monotonic() + timeout
        for job in await self._transfer_jobs():
            on_progress, close = progress.observer(progress_bar, not self.client.is_awaited)
            try:
                left_s = None if end_s is None else max(0, end_s - time.monotonic())
                await job_calls.follow(self.client, job, left_s, on_progress)
            finally:
                close()
        self.summary = await get(self.client, self.name)

    async def _transfer_jobs(self) -> list[decomposition_pb2.Job]:
        """The jobs whose end decides whether the model has a transfer: those that wait or run, or else the newest one
        that did not succeed, if no transfer is stored."""
        found = [job async for job in job_calls.listed(self.client, ["queued", "running", "failed", "cancelled"])
                 if job_calls.is_transfer(job) and job.modal_model == self.name]
        awaited = [job for job in found if job_calls.state_of(job) in ("queued", "running")]
        return awaited or ([] if (await get(self.client, self.name)).transfers else found[:1])

    @call
    async def update(self, *, label: Optional[str] = None, add_tags: tuple[str, ...] = (),
                     remove_tags: tuple[str, ...] = (), pinned: Optional[bool] = None) -> None:
        """Changes the label, the tags or the pin of the model."""
        request = modal_model_service_pb2.UpdateModalModelRequest(
            name=self.name, label=label, add_tags=add_tags, remove_tags=remove_tags)
        if pinned is not None:
            request.pinned = pinned
        self.summary = (await self.client.ask(self.client.models_stub.UpdateModalModel, request)).modal_model

    @call
    async def delete(self) -> None:
        """Deletes the model; objects that sound with it go on sounding."""
        request = modal_model_service_pb2.DeleteModalModelRequest(name=self.name)
        await self.client.ask(self.client.models_stub.DeleteModalModel, request)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.label or self.name}: {checks.counted(self.mode_count, 'mode')}>"

    def _repr_html_(self) -> str:
        cells = "".join(f"<tr><th>{key}</th><td>{html.escape(value)}</td></tr>" for key, value in self._rows().items())
        return f"<table>{cells}</table>"

    def _rows(self) -> dict[str, str]:
        """What a notebook shows of the model."""
        header = self.summary.header
        return {"model": self.name, "label": self.label, "modes": str(self.mode_count),
                "mesh": f"{header.node_count} nodes, {header.element_count} tetrahedra",
                "volume": f"{header.volume_m3:.6g} m³",
                **{f"warning {i}": text for i, text in enumerate(self.warnings, start=1)}}


class Model(Blocking, ModelCalls):
    __doc__ = ModelCalls.__doc__

    @functools.cached_property
    def eigenvalues(self) -> numpy.ndarray:
        """Lambda of each mode for unit material, ascending."""
        return finished(self._eigenvalues())

    @functools.cached_property
    def arrays(self) -> dict[str, numpy.ndarray]:
        """The arrays of the stored model by name, such as "vertices" (V x 3), "triangles" (T x 3) and "shapes"
        (V x 3 x modes); docs/model_format.md lists them."""
        return finished(self._arrays())

    def plot_modes(self, material: Optional[materials.Material] = None, axes: Any = None) -> Any:
        """Draws the modes at their frequencies, each as high as the sound power that it radiates at the same speed of
        vibration. Without a transfer for the material that is the power of the paper's coupling, as the title says.
        Needs matplotlib. Returns its axes."""
        from carillon import plots
        power = self.radiation_decays(material)
        radiates = power.any()
        if not radiates:
            power = self.arrays["couplings"] ** 2
        return plots.plot_modes(self.frequencies(material), power, f"{self.label or self.name}: modes by " + (
            "radiated power" if radiates else "the paper's coupling, for lack of a transfer"), axes)

    def plot_shape(self, mode: int, axes: Any = None) -> Any:
        """Draws the shape of one mode, counted from zero; needs matplotlib. Returns its axes."""
        from carillon import plots
        frequency = f": {self.frequencies()[mode]:.1f} Hz" if self.material is not None else ""
        return plots.plot_shape(self.arrays, mode, f"{self.label or self.name}, mode {mode}{frequency}", axes)

    def _rows(self) -> dict[str, str]:
        rows = super()._rows()
        if self.material is not None and self.mode_count:
            low, high = self.frequencies()[[0, -1]]
            rows["frequencies"] = f"{low:.1f} to {high:.1f} Hz"
        return rows


class AsyncModel(Awaited, ModelCalls):
    """A modal model, whose methods are those of Model, awaited; so are `eigenvalues()` and `arrays()`."""

    async def eigenvalues(self) -> numpy.ndarray:
        """Lambda of each mode for unit material, ascending."""
        return await self._eigenvalues()

    async def arrays(self) -> dict[str, numpy.ndarray]:
        """The arrays of the stored model by name; see Model.arrays."""
        return await self._arrays()


AnyModel = TypeVar("AnyModel", bound=ModelCalls)


async def get(connection: Connection, name: str) -> modal_model_service_pb2.ModalModelSummary:
    """Returns the message that describes the model with this name."""
    request = modal_model_service_pb2.GetModalModelRequest(name=name)
    return (await connection.ask(connection.models_stub.GetModalModel, request)).modal_model


async def listed(connection: Connection, filters: Mapping[str, Any]
                 ) -> AsyncGenerator[modal_model_service_pb2.ModalModelSummary, None]:
    """Yields the models that match, newest first, a page at a time."""
    request = checks.message(modal_model_service_pb2.ListModalModelsRequest, "models", filters)
    while True:
        page = await connection.ask(connection.models_stub.ListModalModels, request)
        for summary in page.modal_models:
            yield summary
        if not page.next_page_token:
            return
        request.page_token = page.next_page_token


async def find(connection: Connection, text: str) -> modal_model_service_pb2.ModalModelSummary:
    """Returns the model that the text means: a name, a label, or the first digits of a digest."""
    if not isinstance(text, str) or not text.removeprefix(PREFIX):
        checks.refuse(text, "the model", "its label, its name, or the first digits of its digest")
    if text.startswith(PREFIX):
        return await get(connection, text)
    labels, found = set(), []
    async for summary in listed(connection, {}):
        labels.add(summary.label)
        if summary.label == text or summary.name.removeprefix(PREFIX).startswith(text):
            found.append(summary.name)
    if len(found) == 1:
        return await get(connection, found[0])
    if found:
        raise errors.CarillonError("NAME_AMBIGUOUS", f"'{text}' means {len(found)} of the models, for instance "
                                   f"{found[0]} and {found[1]}; give more digits of the digest")
    hint = checks.suggestion(text, labels - {""})
    raise errors.CarillonError("MODAL_MODEL_NOT_FOUND", f"no model has the label '{text}' or begins with these "
                               "digits" + (f"; {hint}" if hint else ""))
