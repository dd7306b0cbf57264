# SPDX-License-Identifier: Apache-2.0
"""Recordings of what the daemon plays, and of the contacts that it gets."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncGenerator
from typing import Any, Optional, TypeVar

import numpy

from carillon import checks, errors
from carillon.connection import Connection
from carillon.faces import AwaitedBlock, Block, BlockingBlock, call, finished
from carillon.sound import Sound
from carillon.traces import Trace
from carillon.v1 import audio_service_pb2, contact_service_pb2


class _Recording(Block):
    """What the daemon plays within the block, from its first line on, which `take` returns piece by piece. `sound` is
    what was heard and not taken yet, also after the block, however it ended."""

    def __init__(self, client: Connection, request: dict[str, Any]):
        self._client = client
        self._request = checks.message(audio_service_pb2.ListenRequest, "recording", request)
        self._heard = bytearray()
        self._lost = self._told_lost = 0
        self._taken = 0  # frames
        # Where the numbers of frames leap: how many frames were heard before, and what to add to such a count.
        self._leaps: list[tuple[int, int]] = []
        self._error: Optional[errors.CarillonError] = None
        self._call: Any = None

    async def _open(self) -> AsyncGenerator[Any, None]:
        """Begins to listen, and returns the answers with the blocks."""
        self._call = self._client.audio_stub.Listen(self._request)
        answers = self._client.messages(self._call)
        self._format = (await answers.__anext__()).format
        self._short = self._format.encoding == audio_service_pb2.AUDIO_ENCODING_INT16
        self._frame_bytes = (2 if self._short else 4) * self._format.channel_count
        return answers

    def _take_in(self, answer: audio_service_pb2.ListenResponse) -> None:
        count = self._taken + len(self._heard) // self._frame_bytes
        if not self._leaps or answer.block.first_frame != count + self._leaps[-1][1]:
            self._leaps.append((count, answer.block.first_frame - count))
        self._heard += answer.block.samples
        self._lost = answer.lost_frame_count

    @property
    def sound(self) -> Sound:
        return self._sound_of(bytes(self._heard))

    def _sound_of(self, heard: bytes) -> Sound:
        samples = numpy.frombuffer(heard, "<i2" if self._short else "<f4")
        if self._short:
            samples = samples.astype("<f4") / 32767
        return Sound(samples.reshape(-1, self._format.channel_count), self._format.sample_rate_hz,
                     self._lost - self._told_lost, first_frame=self._first_frame())

    def _first_frame(self) -> Optional[int]:
        """The number of the first frame that was not taken yet; None before anything was heard."""
        before = [added for count, added in self._leaps if count <= self._taken]
        return self._taken + before[-1] if before else None

    def _has(self, frame_count: int) -> bool:
        """Whether a take of so many frames need not wait."""
        return len(self._heard) >= frame_count * self._frame_bytes or self._error is not None

    def _frames_of(self, seconds: float) -> int:
        if not seconds > 0:
            checks.refuse(seconds, "seconds", "more than 0")
        return int(seconds * self._format.sample_rate_hz)

    def _take(self, frame_count: int) -> Sound:
        end = frame_count * self._frame_bytes
        if len(self._heard) < end and self._error:
            raise self._error
        taken = self._sound_of(bytes(self._heard[:end]))
        del self._heard[:end]
        self._taken += frame_count
        self._told_lost = self._lost
        return taken


class Recording(BlockingBlock, _Recording):
    """What the daemon plays within the block, from its first line on; a thread collects it. `sound` is what was heard
    and not taken yet, also after the block, however it ended."""

    async def _enter(self) -> None:
        answers = await self._open()
        self._more = threading.Condition()
        self._reader = threading.Thread(target=lambda: finished(self._read(answers)), daemon=True)
        self._reader.start()

    async def _read(self, answers: AsyncGenerator[Any, None]) -> None:
        try:
            async for answer in answers:
                with self._more:
                    self._take_in(answer)
                    self._more.notify_all()
        except errors.CarillonError as error:
            with self._more:
                self._error = error
                self._more.notify_all()

    def take(self, seconds: float) -> Sound:
        """Waits for the next seconds of the sound, and returns them. The first call begins where the recording begins,
        and each further call where the one before ended, without a gap. `lost_frame_count` of the sound counts the
        frames that were lost since that call. Raises CarillonError if the recording ends before."""
        wanted = self._frames_of(seconds)
        with self._more:
            self._more.wait_for(lambda: self._has(wanted))
            return self._take(wanted)

    def stop(self) -> None:
        """Ends the recording."""
        self._call.cancel()
        self._reader.join()

    async def _leave(self, kind: Optional[type[BaseException]]) -> None:
        self.stop()


class AsyncRecording(AwaitedBlock, _Recording):
    """What the daemon plays within the block, from its first line on; a task collects it. `sound` is what was heard and
    not taken yet."""

    async def _enter(self) -> None:
        answers = await self._open()
        self._more = asyncio.Condition()
        self._reader = asyncio.create_task(self._read(answers))

    async def _read(self, answers: AsyncGenerator[Any, None]) -> None:
        try:
            async for answer in answers:
                self._take_in(answer)
                async with self._more:
                    self._more.notify_all()
        except errors.CarillonError as error:
            self._error = error
            async with self._more:
                self._more.notify_all()

    async def take(self, seconds: float) -> Sound:
        """Waits for the next seconds of the sound, and returns them; see Recording.take."""
        wanted = self._frames_of(seconds)
        async with self._more:
            await self._more.wait_for(lambda: self._has(wanted))
            return self._take(wanted)

    async def stop(self) -> None:
        """Ends the recording."""
        self._reader.cancel()
        await asyncio.wait([self._reader])

    async def _leave(self, kind: Optional[type[BaseException]]) -> None:
        await self.stop()


class _TraceRecording(Block):
    """Has the daemon record the next stream of contacts that begins within the block."""

    def __init__(self, client: Connection, scene: str):
        self._client = client
        self._request = contact_service_pb2.RecordContactsRequest(scene=scene)

    async def _enter(self) -> None:
        self._call = self._client.contacts_stub.RecordContacts(self._request)
        self._answers = self._client.messages(self._call)
        await self._answers.__anext__()  # it has begun

    @call
    async def take(self) -> Trace:
        """Waits until the stream has ended. Returns its trace."""
        return Trace.of([answer.record async for answer in self._answers])

    def cancel(self) -> None:
        """Ends the recording."""
        self._call.cancel()

    async def _leave(self, kind: Optional[type[BaseException]]) -> None:
        self.cancel()


class TraceRecording(BlockingBlock, _TraceRecording):
    __doc__ = _TraceRecording.__doc__


class AsyncTraceRecording(AwaitedBlock, _TraceRecording):
    __doc__ = _TraceRecording.__doc__


AnyRecording = TypeVar("AnyRecording", Recording, AsyncRecording)
AnyTraceRecording = TypeVar("AnyTraceRecording", TraceRecording, AsyncTraceRecording)


async def heard(recording: Recording | AsyncRecording, seconds: float) -> Sound:
    """Records what the daemon plays from now on."""
    await recording._enter()
    try:
        return await recording.take(seconds) if isinstance(recording, AsyncRecording) else recording.take(seconds)
    finally:
        await recording._leave(None)
