# SPDX-License-Identifier: Apache-2.0
"""Scenes, and the objects that sound in them."""

from __future__ import annotations

import numbers
from collections.abc import Iterable, Mapping
from typing import Any, Generic, Optional, TypeVar

from carillon import checks, contacts, errors, job_calls, materials
from carillon.connection import Connection
from carillon.contacts import Array, PoseLike
from carillon.faces import Awaited, AwaitedBlock, Block, Blocking, BlockingBlock, call
from carillon.recordings import (
    AnyRecording, AnyTraceRecording, AsyncRecording, AsyncTraceRecording, Recording, TraceRecording, heard)
from carillon.sound import Sound
from carillon.streams import AnyStream, AsyncContactStream, ContactStream, StreamCalls
from carillon.v1 import contact_service_pb2, radiation_pb2, scene_service_pb2

ADD_ARGUMENTS = ("model", "material", "size", "gain", "pose", "handle", "radiation")


class ObjectCalls(Generic[AnyStream]):
    """An object of a scene. It stands for its handle wherever handles are wanted: int(object)."""

    scene: SceneCalls[Any, AnyStream, Any, Any]

    def __init__(self, scene: Any, message: scene_service_pb2.SoundingObject):
        self.scene = scene
        self.message = message

    @property
    def name(self) -> str:
        return self.message.name

    @property
    def handle(self) -> int:
        return self.message.handle

    __int__ = __index__ = lambda self: self.message.handle

    @call
    async def strike(self, point: Array, impulse: Array, duration: Optional[float] = None, *,
                     striker: contacts.Striker = None) -> None:
        """Strikes the object now: the point in metres and the impulse in newton seconds, both in the object's own
        frame; `duration` of the contact in seconds, or the `striker`, such as "wood". Raises CarillonError if the
        strike is refused; a ContactWarning tells of a point that lies far from the object, and the like."""
        impacts = contacts.strike_of(self, point, impulse, duration, striker)
        stream = self.scene.stream(step=0.001, delay=0)
        stream.step(0.0, impacts=impacts)
        await StreamCalls.close(stream, warn=False)
        if stream.rejection:
            raise stream.rejection
        errors.warn_of_contacts(stream.warnings)

    @call
    async def update(self, *, material: Optional[materials.Material] = None, size: Optional[float] = None,
                     gain: Optional[float] = None, pose: Optional[PoseLike] = None, glide: float = 0,
                     radiation: Optional[materials.Radiation] = None) -> None:
        """Changes what is given; a pose is reached after `glide` seconds. `gain` is a linear factor: 1 keeps the
        level, 0.5 lowers it by 6 dB, and 10 ** (x / 20) changes it by x decibels."""
        request = checks.message(scene_service_pb2.UpdateObjectRequest, "update", dict(
            name=self.name, material=None if material is None else materials.to_message(material), size=size, gain=gain,
            pose=None if pose is None else contacts.to_pose(pose), glide_s=checks.number(glide, "glide", "seconds"),
            radiation=materials.to_radiation(radiation)))
        client = self.scene.client
        self.message = (await client.ask(client.scenes_stub.UpdateObject, request)).object

    @call
    async def remove(self) -> None:
        """Fades the object out and removes it."""
        client = self.scene.client
        await client.ask(client.scenes_stub.RemoveObject, scene_service_pb2.RemoveObjectRequest(name=self.name))

    def __repr__(self) -> str:
        item = self.message
        return (f"<{type(self).__name__} {item.handle}: {checks.counted(item.sounding_mode_count, 'mode')}, "
                f"{item.lowest_frequency_hz:.1f} to {item.highest_frequency_hz:.1f} Hz>")


class SoundingObject(Blocking, ObjectCalls[ContactStream]):
    __doc__ = ObjectCalls.__doc__


class AsyncObject(Awaited, ObjectCalls[AsyncContactStream]):
    """An object of a scene, whose methods are those of SoundingObject, awaited. It stands for its handle, too."""


AnyObject = TypeVar("AnyObject", SoundingObject, AsyncObject)


class SceneCalls(Block, Generic[AnyObject, AnyStream, AnyRecording, AnyTraceRecording]):
    """A scene of the daemon; as a context manager it is deleted at the end. `existing`: it was there before its
    Client.scene, which had an id."""

    _object_kind: type[AnyObject]
    _stream_kind: type[AnyStream]
    _recording_kind: type[AnyRecording]
    _trace_recording_kind: type[AnyTraceRecording]

    def __init__(self, client: Connection, name: str, existing: bool = False):
        self.client = client
        self.name = name
        self.existing = existing

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name} of {self.client.server}>"

    @call
    async def get(self) -> scene_service_pb2.Scene:
        """Returns the scene's state: its volume, peak, and how long it lasts."""
        request = scene_service_pb2.GetSceneRequest(name=self.name)
        return (await self.client.ask(self.client.scenes_stub.GetScene, request)).scene

    @call
    async def add_all(self, objects: Iterable[Mapping[str, Any] | materials.ModelLike | str]) -> list[AnyObject]:
        """Adds all objects, or none if one is refused; `metadata["index"]` of the error is its place. An object is a
        model, or the arguments of `add` by name, such as {"model": bell, "handle": 3, "gain": 0.5}."""
        wanted = []
        for i, item in enumerate(objects):
            if isinstance(item, Mapping):
                checks.refuse_unknown(item, ADD_ARGUMENTS, f"object {i} of add_all")
            wanted.append(self._new_object(**item) if isinstance(item, Mapping) else self._new_object(item))
        return await self._add(wanted)

    @call
    async def add(self, model: materials.ModelLike | str, material: Optional[materials.Material] = None, *,
                  size: float = 1, gain: float = 1, pose: Optional[PoseLike] = None, handle: int = 0,
                  radiation: Optional[materials.Radiation] = None) -> AnyObject:
        """Adds an object, ready to be struck. Without a material it gets the one that the model was asked for with.
        `gain` is linear, as in SoundingObject.update. A TransferWarning tells, once a model, that it is still being
        computed how the model radiates."""
        wanted = self._new_object(model, material, size=size, gain=gain, pose=pose, handle=handle, radiation=radiation)
        return (await self._add([wanted]))[0]

    async def _add(self, wanted: list[scene_service_pb2.NewObject]) -> list[AnyObject]:
        request = scene_service_pb2.AddObjectsRequest(scene=self.name, objects=wanted)
        answer = await self.client.ask(self.client.scenes_stub.AddObjects, request)
        await self._warn_of_transfers({item.modal_model for asked, item in zip(wanted, answer.objects)
                                       if asked.radiation == radiation_pb2.RADIATION_MODEL_UNSPECIFIED
                                       and item.radiation == radiation_pb2.RADIATION_MODEL_PAPER_COUPLING})
        return [self._object_kind(self, item) for item in answer.objects]

    async def _warn_of_transfers(self, models: set[str]) -> None:
        """Warns, once of each model, if the transfers that the objects lack are being computed."""
        unasked = models - self.client.sounded_models
        self.client.sounded_models |= unasked
        if unasked:
            await job_calls.warn_of_transfers(self.client, unasked, "the objects sound by the paper's coupling, at "
                                              "other levels, until they change to it")

    def _new_object(self, model: materials.ModelLike | str, material: Optional[materials.Material] = None, *,
                    size: float = 1, gain: float = 1, pose: Optional[PoseLike] = None, handle: int = 0,
                    radiation: Optional[materials.Radiation] = None) -> scene_service_pb2.NewObject:
        name, message = materials.named(model, material)
        return checks.message(scene_service_pb2.NewObject, "add", dict(
            modal_model=name, material=message, size=size, gain=gain, handle=handle,
            pose=None if pose is None else contacts.to_pose(pose), radiation=materials.to_radiation(radiation)))

    @call
    async def objects(self) -> list[AnyObject]:
        """Returns the objects of the scene by their handles."""
        request = scene_service_pb2.ListObjectsRequest(scene=self.name)
        answer = await self.client.ask(self.client.scenes_stub.ListObjects, request)
        return [self._object_kind(self, item) for item in answer.objects]

    @call
    async def update(self, *, gain: Optional[float] = None, muted: Optional[bool] = None,
                     solo: Optional[bool] = None) -> scene_service_pb2.Scene:
        """Changes the volume within 30 ms, and returns the scene's state. `gain` is a linear factor: 1 keeps the level,
        and 10 ** (x / 20) changes it by x decibels. A `muted` scene rings on unheard. If you set `solo` for some of
        your scenes, the others are not heard."""
        request = checks.message(scene_service_pb2.UpdateSceneRequest, "update", dict(
            name=self.name, gain=gain, muted=muted, solo=solo))
        return (await self.client.ask(self.client.scenes_stub.UpdateScene, request)).scene

    @call
    async def stop(self) -> None:
        """Fades out all that sounds in the scene. Later contacts sound."""
        await self.client.ask(self.client.scenes_stub.StopAll, scene_service_pb2.StopAllRequest(scene=self.name))

    @call
    async def listen(self, seconds: float) -> Sound:
        """Records the scene alone, before the gain and the limiter of the output."""
        return await heard(self._recording_kind(self.client, {"scene": self.name}), seconds)

    def recording_contacts(self) -> AnyTraceRecording:
        """Has the daemon record the next stream of contacts that begins within the block. After the stream's end,
        `take` of what the block gets returns its trace, which renders to the same samples."""
        return self._trace_recording_kind(self.client, self.name)

    @call
    async def move_listener(self, pose: PoseLike, glide: float = 0) -> None:
        """Moves the listener, within `glide` seconds."""
        request = scene_service_pb2.UpdateListenerRequest(
            scene=self.name, pose=contacts.to_pose(pose), glide_s=checks.number(glide, "glide", "seconds"))
        await self.client.ask(self.client.scenes_stub.UpdateListener, request)

    def stream(self, step: float, delay: Optional[float] = None, *, frame: Optional[contacts.Frame] = None,
               pulse_shape: Optional[contacts.PulseShape] = None) -> AnyStream:
        """Opens a stream for the contacts of a simulation whose steps last `step` seconds. They sound `delay` seconds
        later, by default as soon as the network allows without jitter. `frame` "scene" means that points and impulses
        are in the scene's frame: the daemon turns them into the objects' by their poses, which the steps send."""
        if not (isinstance(step, numbers.Real) and 1e-6 <= step <= 1):
            checks.refuse(step, "step", "the step of the simulator, from 1e-6 to 1 s")
        return self._stream_kind(self.client, contact_service_pb2.ContactStreamStart(
            scene=self.name, step_s=step, scheduling_delay_s=delay, frame=contacts.to_frame(frame),
            pulse_shape=contacts.to_pulse_shape(pulse_shape)))

    @call
    async def delete(self) -> None:
        """Deletes the scene and fades out its objects."""
        await self.client.ask(self.client.scenes_stub.DeleteScene, scene_service_pb2.DeleteSceneRequest(name=self.name))

    async def _leave(self, kind: Optional[type[BaseException]]) -> None:
        try:
            await SceneCalls.delete(self)
        except errors.CarillonError as error:
            # The scene is gone already, or an exception of the caller is on its way, which says more.
            if error.reason != "SCENE_NOT_FOUND" and kind is None:
                raise


class Scene(BlockingBlock, SceneCalls[SoundingObject, ContactStream, Recording, TraceRecording]):
    __doc__ = SceneCalls.__doc__
    _object_kind, _stream_kind = SoundingObject, ContactStream
    _recording_kind, _trace_recording_kind = Recording, TraceRecording


class AsyncScene(AwaitedBlock, SceneCalls[AsyncObject, AsyncContactStream, AsyncRecording, AsyncTraceRecording]):
    """A scene, whose methods are those of Scene, awaited, except `stream` and `recording_contacts`; as a context
    manager it is deleted at the end."""

    _object_kind, _stream_kind = AsyncObject, AsyncContactStream
    _recording_kind, _trace_recording_kind = AsyncRecording, AsyncTraceRecording

    async def strike(self, item: AsyncObject, point: Array, impulse: Array, duration: Optional[float] = None, *,
                     striker: contacts.Striker = None) -> None:
        """Strikes an object; see SoundingObject.strike."""
        await item.strike(point, impulse, duration, striker=striker)

    async def remove(self, item: AsyncObject) -> None:
        """Removes an object; see SoundingObject.remove."""
        await item.remove()


AnyScene = TypeVar("AnyScene", Scene, AsyncScene)
