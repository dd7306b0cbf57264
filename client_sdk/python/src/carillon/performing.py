# SPDX-License-Identifier: Apache-2.0
"""Sound as an observation: simulations that are performed in step with the daemon."""

from __future__ import annotations

import contextlib
import dataclasses
import queue
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Optional, TypeVar, Union

import grpc
import numpy

from carillon import checks, contacts, errors, job_calls, materials
from carillon.columns import append
from carillon.connection import Connection
from carillon.contacts import Array, ContactForces, Contacts, Impacts, PoseLike, Poses, checked_scale
from carillon.faces import AwaitedBlock, Block, BlockingBlock, call
from carillon.v1 import audio_service_pb2, contact_trace_pb2, performance_pb2, warning_pb2

Environments = Union[None, int, Iterable[int]]
# The trailing metadata in which the daemon tells of warnings.
SUMMARY_KEY = "carillon-summary-bin"
ENVIRONMENT = "the index of an environment, a whole number from 0"
MICROPHONE = "the index of a microphone, a whole number from 0"
OBJECT = "the handle of an object, a whole number"


@dataclasses.dataclass
class Microphone:
    """A microphone at a pose in the scene, or in the frame of the object `on`. It looks along -z of its frame; x points
    to the right, y up."""

    at: PoseLike = (0, 0, 0)
    on: Any = None

    kind = performance_pb2.MICROPHONE_KIND_UNSPECIFIED
    channel_count = 1

    def message(self) -> performance_pb2.Microphone:
        return performance_pb2.Microphone(kind=self.kind, pose=contacts.to_pose(self.at, "at"),
                                          object=0 if self.on is None else checks.index(self.on, "on", OBJECT))


class Omni(Microphone):
    """One channel: the pressure, in pascals unless the performance has another full scale."""

    kind = performance_pb2.MICROPHONE_KIND_OMNI


class Stereo(Microphone):
    """Two channels, left and right, panned."""

    kind = performance_pb2.MICROPHONE_KIND_STEREO
    channel_count = 2


class Ears(Microphone):
    """Two channels, the left and the right ear of the daemon's measured head."""

    kind = performance_pb2.MICROPHONE_KIND_EARS
    channel_count = 2


@dataclasses.dataclass
class Ambisonics(Microphone):
    """(order + 1)^2 channels of ambisonics in the order ACN, normalized by SN3D; `order` is 1 to 3."""

    order: int = 1
    kind = performance_pb2.MICROPHONE_KIND_AMBISONIC

    @property
    def channel_count(self) -> int:  # type: ignore[override]
        return (self.order + 1) ** 2

    def message(self) -> performance_pb2.Microphone:
        message = super().message()
        message.ambisonic_order = self.order
        return message


@dataclasses.dataclass(frozen=True)
class HeardImpacts:
    """The impacts of a step, as columns of N rows: those that were given, and those found among reported contacts. An
    impact on two sounding objects has a row for each. `times` are seconds since the environment's beginning or reset,
    `points` (N x 3, metres) and `impulses` (N x 3, N s) are in the object's frame."""

    environments: numpy.ndarray
    objects: numpy.ndarray
    others: numpy.ndarray
    times: numpy.ndarray
    points: numpy.ndarray
    impulses: numpy.ndarray
    durations: numpy.ndarray

    def __len__(self) -> int:
        return len(self.objects)

    def __getitem__(self, rows: Any) -> HeardImpacts:
        """The impacts of some rows, which a number, a slice or a mask names."""
        if isinstance(rows, (int, numpy.integer)):
            rows = [range(len(self))[rows]]
        return HeardImpacts(*(column[rows] for column in vars(self).values()))


def _heard(message: performance_pb2.PerformedImpacts) -> HeardImpacts:
    return HeardImpacts(
        numpy.array(message.environment, numpy.uint32), numpy.array(message.object, numpy.uint32),
        numpy.array(message.other, numpy.uint32), numpy.array(message.time_s),
        numpy.array(message.point_m, numpy.float32).reshape(-1, 3),
        numpy.array(message.impulse_newton_seconds, numpy.float32).reshape(-1, 3),
        numpy.array(message.duration_s, numpy.float32))


def settings_of(step: float, environments: int, microphones: Iterable[Microphone], latency: float,
                frame: Optional[contacts.Frame], pulse_shape: Optional[contacts.PulseShape],
                more: Mapping[str, Any]) -> performance_pb2.PerformSettings:
    listed = list(microphones)
    for item in listed:
        checks.expect(item, Microphone, "a microphone")
    if step == 0:
        raise ValueError("step is 0; give the duration of a step in seconds")
    if environments == 0:
        raise ValueError("environments is 0; a performance has one or more")
    return checks.message(performance_pb2.PerformSettings, "perform", dict(
        step_s=checks.number(step, "step", "the duration of a step in seconds"), environment_count=environments,
        latency_s=checks.number(latency, "latency", "seconds from a contact to its sound"),
        microphones=[item.message() for item in listed], frame=contacts.to_frame(frame),
        pulse_shape=contacts.to_pulse_shape(pulse_shape), **more))


class PerformanceCalls(Block):
    """Environments whose sound comes in step with their simulation. The block begins them, and its end ends them.
    `channel_count` is that of all microphones together, and `latency` is the constant time from a contact to its sound,
    in seconds; both are known within the block. `step` counts time: step k ends at k times its duration. At the end of
    the block a ContactWarning tells of each of `warnings`, as at the end of a stream."""

    def __init__(self, client: Connection, settings: performance_pb2.PerformSettings):
        self._client = client
        self._settings = settings
        self._next = performance_pb2.PerformStep()  # what the next step brings beside its contacts
        self._handle = 0
        self._rejected_count = self._paper_count = 0
        self._call: Any = None
        self._is_left = False
        self.warnings: list[warning_pb2.Warning] = []
        self.environment_count: int = max(settings.environment_count, 1)
        self.sample_rate_hz = 0
        self.channel_count = 0
        self.latency = 0.0

    async def _enter(self) -> None:
        await self._open()
        begun = (await self._ask(performance_pb2.PerformRequest(settings=self._settings))).begun
        self.sample_rate_hz, self.channel_count = begun.sample_rate_hz, begun.channel_count
        self.latency = begun.latency_frames / begun.sample_rate_hz

    def add(self, model: materials.ModelLike | str, material: Optional[materials.Material] = None, *,
            environments: Environments = None, size: float = 1, gain: float = 1, pose: Optional[PoseLike] = None,
            handle: Optional[int] = None, radiation: Optional[materials.Radiation] = None) -> int:
        """Adds an object to the environments, by default to all, before the contacts of the next step. Returns its
        handle, which is the same in each of them."""
        indices = self._indices(environments)
        name, message = materials.named(model, material)
        self._handle = handle or self._handle + 1
        self._next.added_objects.add(
            object=checks.message(contact_trace_pb2.ContactTraceObject, "add", dict(
                handle=self._handle, modal_model=name, material=message, size=size, gain=gain,
                pose=None if pose is None else contacts.to_pose(pose), radiation=materials.to_radiation(radiation))),
            environments=indices)
        return self._handle

    def remove(self, item: Any, environments: Environments = None) -> None:
        """Removes an object from the environments, by default from all, at the next step. Its sound fades out within
        10 ms."""
        handle = checks.index(item, "the object", OBJECT)
        self._next.removed_objects.add(object=handle, environments=self._indices(environments))

    def move_microphone(self, microphone: int, pose: PoseLike, environments: Environments = None) -> None:
        """Moves a microphone, which its index names, in the environments, by default in all, to its pose at the end of
        the next step."""
        to = contacts.to_pose(pose, "pose")
        microphone = checks.index(microphone, "microphone", MICROPHONE)
        poses = self._next.microphone_poses
        for index in self._indices(environments) or range(self.environment_count):
            poses.microphone.append(microphone)
            poses.environment.append(index)
            poses.position_m.extend((to.position_m.x, to.position_m.y, to.position_m.z))
            turn = to.orientation if to.HasField("orientation") else None
            poses.orientation.extend((turn.w, turn.x, turn.y, turn.z) if turn else (1, 0, 0, 0))

    def _warn(self, trailing_metadata: Optional[Iterable[tuple[str, Any]]]) -> None:
        """Warns of what the daemon tells with the end of the call."""
        for key, value in trailing_metadata or ():
            if key == SUMMARY_KEY:
                self.warnings = list(audio_service_pb2.RenderSummary.FromString(value).warnings)
        errors.warn_of_contacts(self.warnings)

    @call
    async def reset(self, environments: Environments = None) -> None:
        """Ends the sound of environments, by default of all, at once, and lets them begin anew: their time is zero, and
        their objects and microphones are where they were added. The sound is then that of new environments, bit for
        bit. `environments` are indices, or a mask with a boolean for each, and may be none. Raises CarillonError
        (PERFORMANCE_MALFORMED) for an environment that is not there, which changes nothing."""
        named = self._named(environments)
        if named != []:
            reset = performance_pb2.PerformReset(environments=named or ())
            await self._send(performance_pb2.PerformRequest(reset=reset))

    @call
    async def step(self, *, contacts: Optional[Contacts] = None, impacts: Optional[Impacts] = None,
                   forces: Optional[ContactForces] = None,
                   poses: Optional[Poses] = None,
                   time_scale: Optional[float] = None) -> tuple[numpy.ndarray, HeardImpacts]:
        """Performs a step of all environments. Contacts and poses are those at its end, as in ContactStream.step; their
        `environments` have the index of each row, by default 0. The sound lasts the step over `time_scale`, by default
        1, and the step in a pause, at 0. Returns the samples of the step, a float32 array
        [environment, channel, frame] that must not be written to, and the impacts if the performance tells them. Raises
        CarillonError if a contact is rejected, or an object to be added or removed; the step was performed without it,
        and the error has what it gave as `performed`."""
        scale = checked_scale(time_scale)
        step = performance_pb2.PerformStep(time_scale=scale)
        _fill(step, self._settings.frame, contacts, impacts, forces, poses)
        for rows in (*step.contacts, step.poses):
            self._check(max(rows.environment, default=0))
        step.MergeFrom(self._next)
        self._next = performance_pb2.PerformStep()
        message = (await self._ask(performance_pb2.PerformRequest(step=step))).samples
        pieces = [message]
        while not message.is_last:
            message = (await self._receive()).samples
            pieces.append(message)
        samples = numpy.frombuffer(pieces[0].samples if len(pieces) == 1 else b"".join(p.samples for p in pieces),
                                   "<f4")
        if message.paper_coupling_object_count > self._paper_count:
            await job_calls.warn_of_transfers(self._client, {added.object.modal_model for added in step.added_objects},
                                              "the objects sound by the paper's coupling, also after a reset")
        self._paper_count = message.paper_coupling_object_count
        performed = (samples.reshape(self.environment_count, self.channel_count, message.frame_count),
                     _heard(message.impacts))
        if message.rejected_count > self._rejected_count:
            self._rejected_count = message.rejected_count
            error = errors.from_info(message.last_rejection)
            error.performed = performed
            raise error
        return performed

    def _indices(self, environments: Environments) -> list[int]:
        """Indices for a message, where none means all."""
        named = self._named(environments)
        if named == []:
            raise ValueError("environments is empty; leave it out to mean all of them")
        return named or []

    def _named(self, environments: Environments) -> Optional[list[int]]:
        """The indices that are given as one, some, a slice or a mask; None for all."""
        if environments is None:
            return None
        if isinstance(environments, slice):
            return list(range(self.environment_count))[environments]
        given: list[Any] = ([environments] if isinstance(environments, (int, numpy.integer, numpy.bool_))
                            else list(environments))
        if given and all(isinstance(item, (bool, numpy.bool_)) for item in given):
            if len(given) != self.environment_count:
                raise ValueError(f"environments is a mask of {len(given)}, but the performance has "
                                 f"{self.environment_count}")
            return [index for index, is_meant in enumerate(given) if is_meant]
        indices = [checks.integer(item, "an entry of environments", ENVIRONMENT) for item in given]
        for index in indices:
            self._check(index)
        if len(set(indices)) < len(indices):
            raise ValueError(f"environments names one twice: {indices}; a mask has booleans, such as done.astype(bool)")
        return indices

    def _check(self, index: int) -> None:
        """Refuses an environment that is not there."""
        if not 0 <= index < self.environment_count:
            raise errors.CarillonError("PERFORMANCE_MALFORMED", f"environment {index} is unknown; the performance has "
                                       f"{self.environment_count}, counted from 0")

    async def _open(self) -> None:
        raise NotImplementedError

    async def _send(self, request: performance_pb2.PerformRequest) -> None:
        raise NotImplementedError

    async def _receive(self) -> performance_pb2.PerformResponse:
        raise NotImplementedError

    async def _ask(self, request: performance_pb2.PerformRequest) -> performance_pb2.PerformResponse:
        await self._send(request)
        return await self._receive()

    def _refuse_outside(self) -> None:
        """Refuses to send before the block or after it."""
        if self._call is None:
            raise errors.CarillonError("INVALID_STREAM", "this performance has not begun: use it as a context manager, "
                                       "and take its steps within the block")
        if self._is_left:
            raise _ended("its block has been left")

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {checks.counted(self.environment_count, 'environment')}>"


def _ended(why: str) -> errors.CarillonError:
    return errors.CarillonError("CONTACT_STREAM_ENDED", f"this performance has ended, because {why}; begin another one "
                                "by Client.perform")


def _fill(step: performance_pb2.PerformStep, frame: int, reported: Optional[Contacts], impacts: Optional[Impacts],
          forces: Optional[ContactForces], poses: Optional[Poses]) -> None:
    for name, given, kind in (("contacts", reported, Contacts), ("impacts", impacts, Impacts),
                              ("forces", forces, ContactForces)):
        if given is not None:
            checks.expect(given, kind, name)
            message = step.contacts.add()
            count = contacts.fill_columns(message.columns, given, frame)
            _fill_environments(message, given.environments, count)
    if poses is not None:
        checks.expect(poses, Poses, "poses")
        count = contacts.fill_pose_columns(step.poses.columns, poses)
        _fill_environments(step.poses, poses.environments, count)


def _fill_environments(message: Any, environments: Optional[Array], count: int) -> None:
    if environments is not None:
        if numpy.asarray(environments).dtype == bool:
            raise ValueError("environments has the index of each row's environment, and is no mask")
        append(message, environment=contacts.handles_of(environments, count, "environments", ENVIRONMENT))


class Performance(BlockingBlock, PerformanceCalls):
    __doc__ = PerformanceCalls.__doc__

    async def _open(self) -> None:
        self._requests: queue.SimpleQueue[Optional[performance_pb2.PerformRequest]] = queue.SimpleQueue()
        requests: Iterator[performance_pb2.PerformRequest] = iter(self._requests.get, None)
        self._call = self._client.audio_stub.Perform(requests)

    async def _send(self, request: performance_pb2.PerformRequest) -> None:
        self._refuse_outside()
        if not self._call.is_active():
            await self._receive()  # raises the error that has ended the call
        self._requests.put(request)

    async def _receive(self) -> performance_pb2.PerformResponse:
        with errors.translated(self._client.server):
            return next(self._call)

    async def _leave(self, kind: Optional[type[BaseException]]) -> None:
        self._is_left = True
        self._requests.put(None)
        if kind is not None:
            self._call.cancel()
            return
        with contextlib.suppress(grpc.RpcError):  # a step has raised the error that ended the call
            for _ in self._call:
                pass
            self._warn(self._call.trailing_metadata())


class AsyncPerformance(AwaitedBlock, PerformanceCalls):
    __doc__ = PerformanceCalls.__doc__

    async def _open(self) -> None:
        self._call = self._client.audio_stub.Perform()

    async def _send(self, request: performance_pb2.PerformRequest) -> None:
        self._refuse_outside()
        if self._call.cancelled():
            raise _ended("a step that was awaited has been cancelled, such as by asyncio.wait_for")
        if self._call.done():
            await self._receive()  # raises the error that has ended the call
        with errors.translated(self._client.server):
            await self._call.write(request)

    async def _receive(self) -> performance_pb2.PerformResponse:
        with errors.translated(self._client.server):
            answer = await self._call.read()
            if not isinstance(answer, performance_pb2.PerformResponse):
                raise _ended("the daemon has ended it")
            return answer

    async def _leave(self, kind: Optional[type[BaseException]]) -> None:
        self._is_left = True
        if kind is not None:
            self._call.cancel()
            return
        with contextlib.suppress(grpc.RpcError):
            await self._call.done_writing()
            await self._call.code()
            self._warn(await self._call.trailing_metadata())


AnyPerformance = TypeVar("AnyPerformance", Performance, AsyncPerformance)


class HearingEnvironment:
    """An environment in the shape of gymnasium's Env that adds the sound of each step to the observations of another
    one, without needing gymnasium.

    `environment` has reset(seed=, options=) and step(action), as gymnasium's Env. `contacts_of(environment)` returns
    the arguments of Performance.step for the step that it has just taken, such as {"contacts": ..., "poses": ...}.
    `sound` is a Performance of one environment. An observation is {"state": that of the environment, "sound": float32
    [channel, frame]}, and info["impacts"] has the impacts of the step if the performance tells them."""

    def __init__(self, environment: Any, sound: Performance, contacts_of: Any):
        if sound.environment_count != 1:
            raise ValueError(f"the performance has {sound.environment_count} environments; it must have one")
        self.environment, self.sound, self.contacts_of = environment, sound, contacts_of
        step_s, rate_hz = sound._settings.step_s, sound.sample_rate_hz
        self._shape = (sound.channel_count, round(step_s * rate_hz))
        self.observation_space = {"state": getattr(environment, "observation_space", None),
                                  "sound": {"shape": self._shape, "dtype": numpy.float32}}
        self.action_space = getattr(environment, "action_space", None)

    def __getattr__(self, name: str) -> Any:
        """Whatever else the environment has, such as render, close, spec or metadata."""
        if name == "environment":  # before __init__, as in a copy
            raise AttributeError(name)
        return getattr(self.environment, name)

    def reset(self, *, seed: Optional[int] = None, options: Optional[dict[str, Any]] = None
              ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Resets the environment and its sound. The sound of the first observation is silence."""
        state, info = self.environment.reset(seed=seed, options=options)
        self.sound.reset()
        return {"state": state, "sound": numpy.zeros(self._shape, numpy.float32)}, info

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Takes a step, and lets its contacts sound."""
        state, reward, terminated, truncated, info = self.environment.step(action)
        samples, impacts = self.sound.step(**self.contacts_of(self.environment))
        return {"state": state, "sound": samples[0]}, reward, terminated, truncated, {**info, "impacts": impacts}
