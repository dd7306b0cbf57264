# SPDX-License-Identifier: Apache-2.0
"""The client for asyncio.

    async with carillon.aio.connect() as c:
        bell = await c.create_model("bell.obj", material="bell_bronze")
        sound = await c.render_strike(bell, point=(0, 0, 0.1), impulse=(0, 0, -0.01))

Each call runs on a thread of its own, so that the event loop never waits. A task that is cancelled cancels its call.
Models, jobs and objects of scenes, too, have coroutines for everything that asks the daemon. Methods that do not wait,
such as ContactStream.step, are called as they are.
"""

from __future__ import annotations

import asyncio
import contextvars
import os
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Optional, TypeVar

import numpy

from carillon import client
from carillon.contacts import Array, PoseLike, Striker
from carillon.errors import CarillonError, translated
from carillon.jobs import Job, to_states
from carillon.materials import Material, ModelLike
from carillon.models import Model
from carillon.scenes import ContactStream, Scene, SoundingObject
from carillon.sound import Sound
from carillon.traces import Trace
from carillon.v1 import (
    audio_service_pb2, contact_pb2, contact_service_pb2, decomposition_pb2, decomposition_service_pb2, material_pb2,
    modal_model_service_pb2, scene_service_pb2, server_service_pb2)

Result = TypeVar("Result")

# The loop's own threads are few, so that calls which wait long would keep the others waiting.
_threads = ThreadPoolExecutor(max_workers=4096, thread_name_prefix="carillon")


def connect(server: Optional[str] = None, *, tls_roots: str | os.PathLike[str] | None = None,
            **credentials: Any) -> AsyncClient:
    """Connects as carillon.connect does."""
    return AsyncClient(client.connect(server, tls_roots=tls_roots, **credentials))


async def in_thread(function: Callable[..., Result], *arguments: Any, **named: Any) -> Result:
    """Calls a function of the client on a thread. If the task is cancelled, so are the calls of the function that
    stream, and the others end by themselves."""
    calls: list[Any] = []
    context = contextvars.copy_context()
    context.run(client.running_calls.set, calls)
    work = asyncio.get_running_loop().run_in_executor(_threads, lambda: context.run(function, *arguments, **named))
    try:
        return await asyncio.shield(work)
    except asyncio.CancelledError:
        for call in calls:
            call.cancel()
        await asyncio.wait([work])
        work.exception()
        raise


def _next_answer(answers: Any, sync: client.Client) -> Any:
    """The next answer of a stream; None at its end. Cancelling the task cancels the stream."""
    calls = client.running_calls.get()
    if calls is not None:
        calls.append(answers)
    with translated(sync.server):
        return next(answers, None)


class AsyncClient:
    """A connection. `sync` is the client that it calls; what has no method here is called by in_thread."""

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
            while (answer := await in_thread(_next_answer, answers, self.sync)) is not None:
                yield AsyncJob(Job(self.sync, answer.job)) if answer.HasField("job") else None
        finally:
            answers.cancel()

    async def set_volume(self, **volume: Any) -> audio_service_pb2.UpdateMixerResponse:
        return await in_thread(self.sync.set_volume, **volume)

    async def stop_all(self) -> int:
        return await in_thread(self.sync.stop_all)

    async def scene(self, **settings: Any) -> AsyncScene:
        return AsyncScene(await in_thread(self.sync.scene, **settings))

    async def scenes(self) -> list[AsyncScene]:
        return [AsyncScene(found) for found in await in_thread(self.sync.scenes)]

    async def render(self, trace: Trace | str | os.PathLike[str], **settings: Any) -> Sound:
        return await in_thread(self.sync.render, trace, **settings)

    async def render_strike(self, model: AsyncModel, **strike: Any) -> Sound:
        """Renders a strike; see Model.render_strike."""
        return await model.render_strike(**strike)

    async def listen(self, seconds: float) -> Sound:
        return await in_thread(self.sync.listen, seconds)

    def __repr__(self) -> str:
        return f"<AsyncClient of {self.sync.server}>"

    async def __aenter__(self) -> AsyncClient:
        return self

    async def __aexit__(self, *_: Any) -> None:
        await in_thread(self.sync.close)


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
        return await in_thread(self.sync.render_strike, point, impulse, material, **settings)

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

    async def wait(self, progress_bar: Any = False) -> AsyncModel:
        """Follows the job to its end. `progress_bar` as for Job.wait, and is called on another thread."""
        return AsyncModel(await in_thread(self.sync.wait, progress_bar))

    async def cancel(self) -> None:
        await in_thread(self.sync.cancel)

    async def refresh(self) -> AsyncJob:
        await in_thread(self.sync.refresh)
        return self

    def __repr__(self) -> str:
        return repr(self.sync).replace("<Job", "<AsyncJob", 1)


class AsyncObject:
    """An object of a scene, whose methods are those of SoundingObject. It stands for its handle, as that does."""

    def __init__(self, sync: SoundingObject):
        self.sync = sync

    @property
    def name(self) -> str:
        return self.sync.name

    @property
    def handle(self) -> int:
        return self.sync.handle

    @property
    def message(self) -> scene_service_pb2.SoundingObject:
        return self.sync.message

    def __int__(self) -> int:
        return self.sync.handle

    __index__ = __int__

    async def strike(self, point: Array, impulse: Array, duration: Optional[float] = None, *,
                     striker: Striker = None) -> None:
        await in_thread(self.sync.strike, point, impulse, duration, striker=striker)

    async def update(self, **changes: Any) -> None:
        await in_thread(self.sync.update, **changes)

    async def remove(self) -> None:
        await in_thread(self.sync.remove)

    def __repr__(self) -> str:
        return repr(self.sync).replace("<SoundingObject", "<AsyncObject", 1)


class AsyncScene:
    """A scene; as a context manager it is deleted at the end."""

    def __init__(self, sync: Scene):
        self.sync = sync

    @property
    def name(self) -> str:
        return self.sync.name

    async def add(self, model: ModelLike | str, material: Optional[Material] = None,
                  **settings: Any) -> AsyncObject:
        return AsyncObject(await in_thread(self.sync.add, model, material, **settings))

    async def add_all(self, objects: Iterable[Mapping[str, Any] | ModelLike | str]) -> list[AsyncObject]:
        """Adds all objects or none; see Scene.add_all."""
        return [AsyncObject(item) for item in await in_thread(self.sync.add_all, objects)]

    @property
    def existing(self) -> bool:
        return self.sync.existing

    async def get(self) -> scene_service_pb2.Scene:
        return await in_thread(self.sync.get)

    async def strike(self, item: AsyncObject, point: Array, impulse: Array, duration: Optional[float] = None, *,
                     striker: Striker = None) -> None:
        await item.strike(point, impulse, duration, striker=striker)

    async def update(self, item: AsyncObject, **changes: Any) -> None:
        """Changes an object; see SoundingObject.update."""
        await item.update(**changes)

    async def remove(self, item: AsyncObject) -> None:
        await item.remove()

    async def change_volume(self, **volume: Any) -> None:
        """Changes gain, muted or solo; see Scene.update."""
        await in_thread(self.sync.update, **volume)

    async def stop(self) -> None:
        await in_thread(self.sync.stop)

    async def listen(self, seconds: float) -> Sound:
        return await in_thread(self.sync.listen, seconds)

    async def objects(self) -> list[AsyncObject]:
        return [AsyncObject(item) for item in await in_thread(self.sync.objects)]

    async def move_listener(self, pose: PoseLike, glide: float = 0) -> None:
        await in_thread(self.sync.move_listener, pose, glide)

    def stream(self, step: float, delay: Optional[float] = None, **settings: Any) -> AsyncContactStream:
        """Opens a stream; `settings` as for Scene.stream."""
        return AsyncContactStream(self.sync.stream(step, delay, **settings))

    async def delete(self) -> None:
        await in_thread(self.sync.delete)

    def __repr__(self) -> str:
        return repr(self.sync).replace("<Scene", "<AsyncScene", 1)

    async def __aenter__(self) -> AsyncScene:
        return self

    async def __aexit__(self, *_: Any) -> None:
        await self.delete()


class AsyncContactStream:
    """A stream of contacts: all but the end of its block is as in ContactStream, and does not wait."""

    def __init__(self, sync: ContactStream):
        self.sync = sync
        self.step = sync.step

    @property
    def report(self) -> contact_service_pb2.StreamContactsResponse:
        return self.sync.report

    @property
    def findings(self) -> contact_pb2.ContactFindings:
        return self.sync.findings

    @property
    def rejection(self) -> Optional[CarillonError]:
        return self.sync.rejection

    @property
    def late_count(self) -> int:
        return self.sync.late_count

    @property
    def remap_count(self) -> int:
        return self.sync.remap_count

    async def __aenter__(self) -> AsyncContactStream:
        return self

    async def __aexit__(self, kind: Any, *rest: Any) -> None:
        await in_thread(self.sync.__exit__, kind, *rest)


__all__ = ["AsyncClient", "AsyncContactStream", "AsyncJob", "AsyncModel", "AsyncObject", "AsyncScene", "connect",
           "in_thread"]
