# SPDX-License-Identifier: Apache-2.0
"""The client for asyncio, by grpc.aio.

    async with carillon.aio.connect() as c:
        bell = await c.create_model("bell.obj", material="bell_bronze")
        sound = await c.render_strike(bell, point=(0, 0, 0.1), impulse=(0, 0, -0.01))

A task that is cancelled cancels its call. The calls are those of the client without asyncio, all awaited, and so are
those of models, jobs, scenes, objects and recordings. Three differ: `materials()`, `eigenvalues()` and `arrays()` of a
model are methods, because they ask the daemon, `scene.stream(...)` opens at once and is not awaited, and
`await stream.step(...)` does not wait for the daemon but gives the network and other tasks a turn. A client belongs to
one event loop.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable
from typing import Any, Optional

from carillon import checks, materials
from carillon.client import ClientCalls
from carillon.connection import CREDENTIALS, Result
from carillon.errors import CarillonError
from carillon.faces import AwaitedBlock
from carillon.jobs import AsyncJob
from carillon.models import AsyncModel
from carillon.performing import AsyncPerformance
from carillon.recordings import AsyncRecording, AsyncTraceRecording
from carillon.scenes import AsyncObject, AsyncScene
from carillon.sound import Sound
from carillon.streams import AsyncContactStream
from carillon.v1 import material_pb2

# The daemon gives the place of a rendering back a little after its end.
PAUSES_S = tuple(0.01 * 2**i for i in range(8))


def connect(server: Optional[str] = None, *, tls_roots: str | os.PathLike[str] | None = None,
            **credentials: Any) -> AsyncClient:
    """Connects as carillon.connect does."""
    checks.refuse_unknown(credentials, CREDENTIALS, "connect")
    return AsyncClient(server, tls_roots=tls_roots, **credentials)


class AsyncClient(AwaitedBlock, ClientCalls[AsyncModel, AsyncJob, AsyncScene, AsyncRecording, AsyncPerformance]):
    """A connection, as a context manager closed at the end. The attributes *_stub are the services of the contract,
    for calls that have no method here. Renderings wait for each other where the daemon would refuse so many of one
    client."""

    _model_kind, _job_kind, _scene_kind, _recording_kind = AsyncModel, AsyncJob, AsyncScene, AsyncRecording
    _performance_kind = AsyncPerformance
    _places: Optional[asyncio.Semaphore] = None  # of renderings

    async def wait(self, job: AsyncJob, progress_bar: Any = None) -> AsyncModel:
        """Follows a job to its end; see Job.wait."""
        return await job.wait(progress_bar)

    async def materials(self) -> dict[str, material_pb2.Material]:
        """The catalogue of materials by name."""
        return await materials.catalogue(self)

    async def render_strike(self, model: AsyncModel, **strike: Any) -> Sound:
        """Renders a strike; see Model.render_strike."""
        return await model.render_strike(**strike)

    async def in_turn(self, render: Callable[[], Awaitable[Result]]) -> Result:
        if self._places is None:
            limits = (await self.info()).limits
            count = max(1, int(limits.rendering_count * limits.client_share))
            self._places = self._places or asyncio.Semaphore(count)  # another task may have come first
        async with self._places:
            for pause_s in PAUSES_S:
                try:
                    return await render()
                except CarillonError as error:
                    if error.reason != "CLIENT_LIMIT_REACHED":
                        raise
                await asyncio.sleep(pause_s)
            return await render()


__all__ = ["AsyncClient", "AsyncContactStream", "AsyncJob", "AsyncModel", "AsyncObject", "AsyncPerformance",
           "AsyncRecording", "AsyncScene", "AsyncTraceRecording", "connect"]
