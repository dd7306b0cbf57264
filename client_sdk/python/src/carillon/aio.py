# SPDX-License-Identifier: Apache-2.0
"""The client for asyncio.

    async with carillon.aio.connect() as c:
        bell = await c.create_model("bell.obj", material="bell_bronze")
        sound = await c.render_strike(bell, point=(0, 0, 0.1), impulse=(0, 0, -0.01))

Each call runs on a thread of its own, so that the event loop never waits. A task that is cancelled cancels its call.
Models, jobs, scenes, objects and recordings, too, have coroutines for everything that asks the daemon. The calls are
those of the client without asyncio, all awaited. Three differ: `materials()`, `eigenvalues()` and `arrays()` of a model
are methods, because they ask the daemon, `scene.stream(...)` opens at once and is not awaited, and
`await stream.step(...)` does not wait for the daemon but gives other tasks a turn.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import AsyncIterator
from typing import Any, Optional

from carillon import client
from carillon.aio_models import AsyncJob, AsyncModel
from carillon.aio_scenes import (
    AsyncContactStream, AsyncObject, AsyncRecording, AsyncScene, AsyncTraceRecording)
from carillon.aio_threads import in_thread, next_answer, render_in_turn
from carillon.jobs import Job, to_states
from carillon.materials import Material
from carillon.sound import Sound
from carillon.traces import Trace
from carillon.v1 import audio_service_pb2, decomposition_service_pb2, material_pb2, server_service_pb2


def connect(server: Optional[str] = None, *, tls_roots: str | os.PathLike[str] | None = None,
            **credentials: Any) -> AsyncClient:
    """Connects as carillon.connect does."""
    return AsyncClient(client.connect(server, tls_roots=tls_roots, **credentials))


class AsyncClient:
    """A connection. `sync` is the client that it calls; what has no method here is called by in_thread. Renderings wait
    for each other where the daemon would refuse so many of one client."""

    def __init__(self, sync: client.Client):
        self.sync = sync

    async def info(self) -> server_service_pb2.GetServerInfoResponse:
        return await in_thread(self.sync.info)

    async def status(self) -> audio_service_pb2.GetMixerResponse:
        return await in_thread(self.sync.status)

    async def upload(self, mesh: Any) -> str:
        return await in_thread(self.sync.upload, mesh)

    async def create_job(self, mesh: Any, material: Material, **request: Any) -> AsyncJob:
        return AsyncJob(await in_thread(self.sync.create_job, mesh, material, **request))

    async def wait(self, job: AsyncJob, progress_bar: Any = False) -> AsyncModel:
        """Follows a job to its end; see AsyncJob.wait."""
        return await job.wait(progress_bar)

    async def create_model(self, mesh: Any, material: Material, **request: Any) -> AsyncModel:
        request.setdefault("progress_bar", False)
        return AsyncModel(await in_thread(self.sync.create_model, mesh, material, **request))

    async def model(self, text: str, material: Optional[Material] = None) -> AsyncModel:
        return AsyncModel(await in_thread(self.sync.model, text, material))

    async def models(self, **filters: Any) -> AsyncIterator[AsyncModel]:
        found = self.sync.models(**filters)
        while model := await in_thread(lambda: next(found, None)):
            yield AsyncModel(model)

    async def materials(self) -> dict[str, material_pb2.Material]:
        return await in_thread(lambda: self.sync.materials)

    async def jobs(self, **filters: Any) -> AsyncIterator[AsyncJob]:
        """Yields jobs; see Client.jobs."""
        found = self.sync.jobs(**filters)
        while job := await in_thread(lambda: next(found, None)):
            yield AsyncJob(job)

    async def watch_jobs(self, **filters: Any) -> AsyncIterator[Optional[AsyncJob]]:
        """Yields the changes of jobs; see Client.watch_jobs. A cancelled task ends the call."""
        request = decomposition_service_pb2.WatchJobsRequest(
            states=to_states(filters.pop("states", ())), **filters)
        answers = self.sync.jobs_stub.WatchJobs(request)
        try:
            while (answer := await in_thread(next_answer, answers, self.sync)) is not None:
                yield AsyncJob(Job(self.sync, answer.job)) if answer.HasField("job") else None
        finally:
            answers.cancel()

    async def resolve(self, material: Material) -> material_pb2.Material:
        return await in_thread(self.sync.resolve, material)

    async def set_volume(self, **volume: Any) -> audio_service_pb2.UpdateMixerResponse:
        return await in_thread(self.sync.set_volume, **volume)

    async def stop_all(self) -> int:
        return await in_thread(self.sync.stop_all)

    async def scene(self, **settings: Any) -> AsyncScene:
        return AsyncScene(await in_thread(self.sync.scene, **settings))

    async def scenes(self) -> list[AsyncScene]:
        return [AsyncScene(found) for found in await in_thread(self.sync.scenes)]

    async def render(self, trace: Trace | str | os.PathLike[str], **settings: Any) -> Sound:
        return await render_in_turn(self.sync, self.sync.render, trace, **settings)

    async def render_strike(self, model: AsyncModel, **strike: Any) -> Sound:
        """Renders a strike; see Model.render_strike."""
        return await model.render_strike(**strike)

    async def listen(self, seconds: float) -> Sound:
        return await in_thread(self.sync.listen, seconds)

    @contextlib.asynccontextmanager
    async def recording(self, **request: Any) -> AsyncIterator[AsyncRecording]:
        """Records what the daemon plays within the block; see Client.recording."""
        block = self.sync.recording(**request)
        record = await in_thread(block.__enter__)
        try:
            yield AsyncRecording(record)
        finally:
            await in_thread(block.__exit__, None, None, None)

    async def close(self) -> None:
        await in_thread(self.sync.close)

    def __repr__(self) -> str:
        return f"<AsyncClient of {self.sync.server}>"

    async def __aenter__(self) -> AsyncClient:
        return self

    async def __aexit__(self, *_: Any) -> None:
        await self.close()


__all__ = ["AsyncClient", "AsyncContactStream", "AsyncJob", "AsyncModel", "AsyncObject", "AsyncRecording", "AsyncScene",
           "AsyncTraceRecording", "connect", "in_thread"]
