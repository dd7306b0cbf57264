# SPDX-License-Identifier: Apache-2.0
"""The stream of contacts from a running simulation."""

from __future__ import annotations

import asyncio
import atexit
import contextlib
import os
import queue
import threading
from collections.abc import AsyncGenerator, Awaitable, Generator
from typing import Any, Optional, TypeVar

from carillon import checks, contacts, errors
from carillon.connection import Connection
from carillon.contacts import ContactForces, Contacts, Impacts, PoseLike, Poses, make_step
from carillon.faces import AwaitedBlock, Block, BlockingBlock, call, finished, iterated
from carillon.v1 import contact_pb2, contact_service_pb2, warning_pb2

# Steps that may wait for the network before the oldest is dropped.
MOST_WAITING = 4096
# Steps that wait are sent together up to this number and size, because a message costs far more than a small step.
MOST_STEPS_TOGETHER = 256
MOST_BYTES_TOGETHER = 65536


class _OpenStreams:
    """The streams that are not closed. When the program ends, it warns as at the end of each of them."""

    def __init__(self) -> None:
        self.streams: set[StreamCalls] = set()
        atexit.register(self.warn)
        os.register_at_fork(after_in_child=self.leave)

    def leave(self) -> None:
        """Closes the streams in a forked process, where nothing sends their steps."""
        for stream in list(self.streams):
            stream._finish()

    def warn(self) -> None:
        for stream in list(self.streams):
            errors.warn_of_open_stream(stream._start.scene)
            errors.warn_of_contacts(stream.warnings)
            stream._finish()


_open_streams = _OpenStreams()


class StreamCalls(Block):
    """Sends the contacts of each step without waiting for the daemon. `report` is the newest answer, with the counts
    so far. It counts an impulse as accepted before it sounds: one that is due after the scene is deleted is never
    heard, for which `report.ahead_s` says how long to wait after the end. `dropped_step_count` steps were not sent: the
    oldest ones, when more than 4096 waited. At the end of the block a ContactWarning tells of each of `warnings`."""

    _steps: Any
    _call: Any

    def __init__(self, client: Connection, start: contact_service_pb2.ContactStreamStart):
        self._client = client
        self._start = start
        self._error: Optional[errors.CarillonError] = None
        self._is_closed = False
        self.report: contact_service_pb2.StreamContactsResponse = contact_service_pb2.StreamContactsResponse()
        self.dropped_step_count = 0
        self._step_count, self._time_s = 0, 0.0
        _open_streams.streams.add(self)

    @property
    def findings(self) -> contact_pb2.ContactFindings:
        """What the daemon found out about the contacts so far, such as blow_count."""
        return self.report.findings

    @property
    def warnings(self) -> list[warning_pb2.Warning]:
        """What was probably not meant about the contacts so far."""
        told = list(self.report.warnings)
        if self.dropped_step_count:
            count = checks.counted(self.dropped_step_count, "step")
            told.append(warning_pb2.Warning(
                id="STEPS_DROPPED", count=self.dropped_step_count, text=f"{count} not sent, because too many waited "
                "for the network; send fewer or smaller steps in one second"))
        return told

    @property
    def rejection(self) -> Optional[errors.CarillonError]:
        """Why the newest rejected contact was rejected; None if none was so far."""
        return errors.from_info(self.report.last_rejection) if self.report.rejected_count else None

    @property
    def late_count(self) -> int:
        """How many contacts came too late for their time so far, and sounded at once."""
        return self.report.late_count

    @property
    def remap_count(self) -> int:
        """How many times simulation time was mapped anew so far, because every step was late."""
        return self.report.remap_count

    @property
    def waiting_step_count(self) -> int:
        """How many steps wait for the network."""
        return self._steps.qsize()

    def _put_step(self, time: float, *, contacts: Optional[Contacts] = None, impacts: Optional[Impacts] = None,
                  forces: Optional[ContactForces] = None, poses: Optional[Poses] = None,
                  listener: Optional[PoseLike] = None, time_scale: Optional[float] = None) -> None:
        for columns in (contacts, impacts, forces, poses):
            _refuse_other_scenes(columns, self._start.scene)
        self._put(make_step(time, contacts=contacts, impacts=impacts, forces=forces, poses=poses, listener=listener,
                            time_scale=time_scale, frame=self._start.frame))

    def _put(self, step: contact_pb2.ContactStep) -> None:
        if self._is_closed:
            raise errors.CarillonError("CONTACT_STREAM_ENDED", "this stream has been closed, so that the step would "
                                       "not sound; open another one by Scene.stream")
        if self._error:
            _open_streams.streams.discard(self)
            raise self._error.with_traceback(None)  # not that of the thread which reads
        contacts.refuse_time(step.time_s, self._step_count, self._time_s, "open another stream for another run")
        self._step_count, self._time_s = self._step_count + 1, step.time_s
        if self._steps.qsize() >= MOST_WAITING:
            with contextlib.suppress(queue.Empty):  # the thread that sends may have taken it meanwhile
                self._steps.get_nowait()
                self.dropped_step_count += 1
        self._steps.put_nowait(step)

    @call
    async def close(self, warn: bool = True) -> contact_service_pb2.StreamContactsResponse:
        """Waits until the daemon has taken all steps. Returns the last report."""
        self._finish()
        self._steps.put_nowait(None)
        await self._ended()
        if self._error:
            raise self._error
        if warn:
            errors.warn_of_contacts(self.warnings)
        return self.report

    def _finish(self) -> None:
        self._is_closed = True
        _open_streams.streams.discard(self)

    async def _next(self) -> Optional[contact_pb2.ContactStep]:
        """Waits for a step to send, or for None at the end."""
        raise NotImplementedError

    async def _ended(self) -> None:
        """Waits for the daemon's last answer."""
        raise NotImplementedError

    async def _requests(self) -> AsyncGenerator[contact_service_pb2.StreamContactsRequest, None]:
        yield contact_service_pb2.StreamContactsRequest(start=self._start)
        step = await self._next()
        while step is not None:
            steps, following = self._take_waiting(step)
            yield contact_service_pb2.StreamContactsRequest(steps=steps)
            step = following[0] if following else await self._next()

    def _take_waiting(self, step: contact_pb2.ContactStep
                      ) -> tuple[list[contact_pb2.ContactStep], list[Optional[contact_pb2.ContactStep]]]:
        """Returns the steps of the next message, the step and those that wait, as far as there is room. The second
        list has what was taken from the queue beyond them: a step, None at the end, or nothing."""
        steps = [step]
        byte_count = None
        while len(steps) < MOST_STEPS_TOGETHER and not self._steps.empty():
            try:
                waiting = self._steps.get_nowait()
            except queue.Empty:  # the simulation's thread dropped it
                break
            if waiting is None:
                return steps, [None]
            byte_count = (step.ByteSize() if byte_count is None else byte_count) + waiting.ByteSize()
            if byte_count > MOST_BYTES_TOGETHER:
                return steps, [waiting]
            steps.append(waiting)
        return steps, []

    async def _read(self) -> None:
        try:
            async for answer in self._client.messages(self._call):
                self.report = answer
        except errors.CarillonError as error:
            self._error = error
            self._steps.put_nowait(None)  # ends what sends

    def __repr__(self) -> str:
        report = self.report
        return (f"<{type(self).__name__} of {self._start.scene}: {checks.counted(report.step_count, 'step')}, "
                f"{checks.counted(report.accepted_count, 'contact')} in time, {report.late_count} late, "
                f"{report.rejected_count} rejected>")

    async def _leave(self, kind: Optional[type[BaseException]]) -> None:
        if kind is None:
            await StreamCalls.close(self)
        else:
            self._finish()
            self._call.cancel()
            await self._ended()


class ContactStream(BlockingBlock, StreamCalls):
    __doc__ = f"{StreamCalls.__doc__} One thread sends the steps, and another reads the answers."

    def __init__(self, client: Connection, start: contact_service_pb2.ContactStreamStart):
        super().__init__(client, start)
        self._steps = queue.SimpleQueue()
        self._call = client.contacts_stub.StreamContacts(iterated(self._requests()))
        self._reader = threading.Thread(target=lambda: finished(self._read()), daemon=True)
        self._reader.start()

    def step(self, time: float, *, contacts: Optional[Contacts] = None, impacts: Optional[Impacts] = None,
             forces: Optional[ContactForces] = None, poses: Optional[Poses] = None,
             listener: Optional[PoseLike] = None, time_scale: Optional[float] = None) -> None:
        """Sends a step at a simulation time, seconds: the contacts that an engine reports, in every step; strikes;
        loads of a simulator that knows them; poses of objects, and of the listener. `time_scale` is simulation time
        over time of the sound since the step before: 0.25 in slow motion, 4 in fast forward, 0 in a pause, in which
        contacts are left out. Errors as those of `send`."""
        self._put_step(time, contacts=contacts, impacts=impacts, forces=forces, poses=poses, listener=listener,
                       time_scale=time_scale)

    def send(self, step: contact_pb2.ContactStep) -> None:
        """Sends a message of contact.proto. Raises CarillonError if the stream has failed or has been closed
        (CONTACT_STREAM_ENDED), and if the step's time goes back, or is over 1e10 s before or after 0 (INVALID_STREAM);
        such a step is not sent, and the stream can go on."""
        self._put(step)

    async def _next(self) -> Optional[contact_pb2.ContactStep]:
        return self._steps.get()

    async def _ended(self) -> None:
        self._reader.join()


class Turn:
    """Is done already. To await it lets other tasks run."""

    def __await__(self) -> Generator[None, None, None]:
        yield


class AsyncContactStream(AwaitedBlock, StreamCalls):
    __doc__ = StreamCalls.__doc__

    def __init__(self, client: Connection, start: contact_service_pb2.ContactStreamStart):
        super().__init__(client, start)
        self._steps = asyncio.Queue()
        self._call = client.contacts_stub.StreamContacts(self._requests())
        self._reader = asyncio.create_task(self._read())

    def step(self, time: float, **content: Any) -> Awaitable[None]:
        """Sends a step; see ContactStream.step. Await it, which gives the network and other tasks a turn: a loop that
        never awaits anything sends nothing before it ends."""
        self._put_step(time, **content)
        return Turn()

    def send(self, step: contact_pb2.ContactStep) -> Awaitable[None]:
        """Sends a message of contact.proto; see ContactStream.send."""
        self._put(step)
        return Turn()

    async def _next(self) -> Optional[contact_pb2.ContactStep]:
        return await self._steps.get()

    async def _ended(self) -> None:
        await asyncio.wait([self._reader])


AnyStream = TypeVar("AnyStream", ContactStream, AsyncContactStream)


def _refuse_other_scenes(columns: Contacts | Impacts | ContactForces | Poses | None, scene: str) -> None:
    """Raises ValueError for an object of another scene, where its handle may mean another object."""
    for name, other in contacts.scenes_of_objects(columns):
        if other != scene:
            raise ValueError(f"{name} has an object of {other}, and this is a stream of {scene}; give objects of that "
                             "scene")
