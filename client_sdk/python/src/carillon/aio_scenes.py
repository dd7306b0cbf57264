# SPDX-License-Identifier: Apache-2.0
"""Scenes, their objects, streams and recordings for asyncio."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator, Awaitable, Generator, Iterable, Mapping
from typing import Any, Optional

from carillon.aio_threads import cancel_with_task, in_thread
from carillon.client import Recording
from carillon.contacts import Array, PoseLike, Striker
from carillon.errors import CarillonError
from carillon.materials import Material, ModelLike
from carillon.scenes import ContactStream, Scene, SoundingObject, TraceRecording
from carillon.sound import Sound
from carillon.traces import Trace
from carillon.v1 import contact_pb2, contact_service_pb2, scene_service_pb2


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

    async def remove(self, item: AsyncObject) -> None:
        await item.remove()

    async def update(self, **volume: Any) -> scene_service_pb2.Scene:
        """Changes gain, muted or solo; see Scene.update. An object has an update of its own."""
        return await in_thread(self.sync.update, **volume)

    async def stop(self) -> None:
        await in_thread(self.sync.stop)

    async def listen(self, seconds: float) -> Sound:
        return await in_thread(self.sync.listen, seconds)

    @contextlib.asynccontextmanager
    async def recording_contacts(self) -> AsyncIterator[AsyncTraceRecording]:
        """Records the next stream of contacts; see Scene.recording_contacts."""
        block = self.sync.recording_contacts()
        record = await in_thread(block.__enter__)
        try:
            yield AsyncTraceRecording(record)
        finally:
            await in_thread(block.__exit__, None, None, None)

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

    async def __aexit__(self, kind: Any, *rest: Any) -> None:
        await in_thread(self.sync.__exit__, kind, *rest)


class Turn:
    """Is done already. To await it lets other tasks run."""

    def __await__(self) -> Generator[None, None, None]:
        yield


class AsyncContactStream:
    """A stream of contacts, whose methods are those of ContactStream. Only its end waits for the daemon."""

    def __init__(self, sync: ContactStream):
        self.sync = sync

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

    @property
    def waiting_step_count(self) -> int:
        return self.sync.waiting_step_count

    @property
    def dropped_step_count(self) -> int:
        return self.sync.dropped_step_count

    def step(self, time: float, **content: Any) -> Awaitable[None]:
        """Sends a step; see ContactStream.step. To await it gives other tasks a turn, and is not needed."""
        self.sync.step(time, **content)
        return Turn()

    def send(self, step: contact_pb2.ContactStep) -> Awaitable[None]:
        """Sends a message of contact.proto; see ContactStream.send."""
        self.sync.send(step)
        return Turn()

    async def close(self, warn: bool = True) -> contact_service_pb2.StreamContactsResponse:
        return await in_thread(self.sync.close, warn)

    def __repr__(self) -> str:
        return repr(self.sync).replace("<ContactStream", "<AsyncContactStream", 1)

    async def __aenter__(self) -> AsyncContactStream:
        return self

    async def __aexit__(self, kind: Any, *rest: Any) -> None:
        await in_thread(self.sync.__exit__, kind, *rest)


class AsyncRecording:
    """What the daemon plays; see Client.recording. `sound` is what was heard so far."""

    def __init__(self, sync: Recording):
        self.sync = sync

    @property
    def sound(self) -> Sound:
        return self.sync.sound

    async def take(self, seconds: float) -> Sound:
        """Waits until this much of the sound since the beginning was heard, and returns it. A cancelled task ends the
        recording."""
        def take() -> Sound:
            cancel_with_task(self.sync)
            return self.sync.take(seconds)

        return await in_thread(take)

    async def stop(self) -> None:
        await in_thread(self.sync.stop)


class AsyncTraceRecording:
    """A stream of contacts that the daemon records; see Scene.recording_contacts."""

    def __init__(self, sync: TraceRecording):
        self.sync = sync

    async def take(self) -> Trace:
        """Waits until the stream has ended. Returns its trace."""
        def take() -> Trace:
            cancel_with_task(self.sync)
            return self.sync.take()

        return await in_thread(take)
