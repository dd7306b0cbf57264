# SPDX-License-Identifier: Apache-2.0
"""Models and jobs for asyncio."""

from __future__ import annotations

from typing import Any, Optional

import numpy

from carillon.aio_threads import in_thread, render_in_turn
from carillon.contacts import Array
from carillon.jobs import Job
from carillon.materials import Material
from carillon.models import Model
from carillon.sound import Sound
from carillon.v1 import decomposition_pb2, modal_model_service_pb2


class AsyncModel:
    """A modal model, whose methods are those of Model. It stands for its model wherever a model is wanted."""

    def __init__(self, sync: Model):
        self.sync = sync

    @property
    def name(self) -> str:
        return self.sync.name

    @property
    def label(self) -> str:
        return self.sync.label

    @property
    def summary(self) -> modal_model_service_pb2.ModalModelSummary:
        return self.sync.summary

    @property
    def material(self) -> Optional[Material]:
        return self.sync.material

    @property
    def mode_count(self) -> int:
        return self.sync.mode_count

    @property
    def warnings(self) -> list[str]:
        return self.sync.warnings

    async def eigenvalues(self) -> numpy.ndarray:
        return await in_thread(lambda: self.sync.eigenvalues)

    async def arrays(self) -> dict[str, numpy.ndarray]:
        return await in_thread(lambda: self.sync.arrays)

    async def modes(self, material: Optional[Material] = None, size: float = 1) -> tuple[numpy.ndarray, numpy.ndarray]:
        return await in_thread(self.sync.modes, material, size)

    async def frequencies(self, material: Optional[Material] = None, size: float = 1) -> numpy.ndarray:
        return await in_thread(self.sync.frequencies, material, size)

    async def radiation_decays(self, material: Optional[Material] = None, size: float = 1) -> numpy.ndarray:
        return await in_thread(self.sync.radiation_decays, material, size)

    async def render_strike(self, point: Array, impulse: Array, material: Optional[Material] = None,
                            **settings: Any) -> Sound:
        return await render_in_turn(self.sync.client, self.sync.render_strike, point, impulse, material, **settings)

    async def wait_for_transfer(self, timeout: Optional[float] = None, *, progress_bar: Any = False) -> None:
        await in_thread(self.sync.wait_for_transfer, timeout, progress_bar=progress_bar)

    async def update(self, **changes: Any) -> None:
        await in_thread(self.sync.update, **changes)

    async def delete(self) -> None:
        await in_thread(self.sync.delete)

    def __repr__(self) -> str:
        return repr(self.sync).replace("<Model", "<AsyncModel", 1)

    def _repr_html_(self) -> str:
        return self.sync._repr_html_()


class AsyncJob:
    """A decomposition, whose methods are those of Job."""

    def __init__(self, sync: Job):
        self.sync = sync

    @property
    def name(self) -> str:
        return self.sync.name

    @property
    def state(self) -> str:
        return self.sync.state

    @property
    def message(self) -> decomposition_pb2.Job:
        return self.sync.message

    @property
    def is_transfer(self) -> bool:
        return self.sync.is_transfer

    async def wait(self, progress_bar: Any = False, timeout: Optional[float] = None) -> AsyncModel:
        """Follows the job to its end. `progress_bar` as for Job.wait, and is called on another thread."""
        return AsyncModel(await in_thread(self.sync.wait, progress_bar, timeout))

    async def cancel(self) -> None:
        await in_thread(self.sync.cancel)

    async def refresh(self) -> AsyncJob:
        await in_thread(self.sync.refresh)
        return self

    def __repr__(self) -> str:
        return repr(self.sync).replace("<Job", "<AsyncJob", 1)
