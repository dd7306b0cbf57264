# SPDX-License-Identifier: Apache-2.0
"""Scenes, the objects that sound in them, and the stream of contacts from a running simulation."""

from __future__ import annotations

import atexit
import contextlib
import numbers
import os
import queue
import threading
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Optional

import grpc

from carillon import checks, contacts, errors, materials
from carillon.contacts import Array, Contacts, Forces, Impulses, PoseLike, Poses, make_step
from carillon.sound import Sound
from carillon.traces import Trace
from carillon.v1 import contact_pb2, contact_service_pb2, scene_service_pb2

if TYPE_CHECKING:
    from carillon.client import Client

# Steps that may wait for the network before the oldest is dropped.
MOST_WAITING = 4096
# Steps that wait are sent together up to this number and size, because a message costs far more than a small step.
MOST_STEPS_TOGETHER = 256
MOST_BYTES_TOGETHER = 65536
ADD_ARGUMENTS = ("model", "material", "size", "gain", "pose", "handle", "radiation")


class SoundingObject:
    """An object of a scene. It stands for its handle wherever handles are wanted: int(object)."""

    def __init__(self, scene: Scene, message: scene_service_pb2.SoundingObject):
        self.scene = scene
        self.message = message

    @property
    def name(self) -> str:
        return self.message.name

    @property
    def handle(self) -> int:
        return self.message.handle

    __int__ = __index__ = lambda self: self.message.handle

    def strike(self, point: Array, impulse: Array, duration: Optional[float] = None, *,
               striker: contacts.Striker = None) -> None:
        """Strikes the object now: the point in metres and the impulse in newton seconds, both in the object's own
        frame; `duration` of the contact in seconds, or the `striker`, such as "wood". Raises CarillonError if the
        strike is refused; a ContactWarning tells of a point that lies far from the object, and the like."""
        impulses = contacts.strike_of(self, point, impulse, duration, striker)
        stream = self.scene.stream(step=0.001, delay=0)
        stream.step(0.0, impulses=impulses)
        stream.close(warn=False)
        if stream.rejection:
            raise stream.rejection
        errors.warn_of_contacts(stream.findings, "the object's own frame")

    def update(self, *, material: Optional[materials.Material] = None, size: Optional[float] = None,
               gain: Optional[float] = None, pose: Optional[PoseLike] = None, glide: float = 0,
               radiation: Optional[materials.Radiation] = None) -> None:
        """Changes what is given; a pose is reached after `glide` seconds. `gain` is a linear factor: 1 keeps the
        level, 0.5 lowers it by 6 dB, and 10 ** (x / 20) changes it by x decibels."""
        request = checks.message(scene_service_pb2.UpdateObjectRequest, "update", dict(
            name=self.name, material=None if material is None else materials.to_message(material), size=size, gain=gain,
            pose=None if pose is None else contacts.to_pose(pose), glide_s=checks.number(glide, "glide", "seconds"),
            radiation=materials.to_radiation(radiation)))
        client = self.scene.client
        with errors.translated(client.server):
            self.message = client.scenes_stub.UpdateObject(request).object

    def remove(self) -> None:
        """Fades the object out and removes it."""
        client = self.scene.client
        with errors.translated(client.server):
            client.scenes_stub.RemoveObject(scene_service_pb2.RemoveObjectRequest(name=self.name))

    def __repr__(self) -> str:
        item = self.message
        return (f"<SoundingObject {item.handle}: {checks.counted(item.sounding_mode_count, 'mode')}, "
                f"{item.lowest_frequency_hz:.1f} to {item.highest_frequency_hz:.1f} Hz>")


class Scene:
    """A scene of the daemon; as a context manager it is deleted at the end. `existing`: it was there before its
    Client.scene, which had an id."""

    def __init__(self, client: Client, name: str, existing: bool = False):
        self.client = client
        self.name = name
        self.existing = existing

    def __repr__(self) -> str:
        return f"<Scene {self.name} of {self.client.server}>"

    def get(self) -> scene_service_pb2.Scene:
        """Returns the scene's state: its volume, peak, and how long it lasts."""
        with errors.translated(self.client.server):
            return self.client.scenes_stub.GetScene(scene_service_pb2.GetSceneRequest(name=self.name)).scene

    def add_all(self, objects: Iterable[Mapping[str, Any] | materials.ModelLike | str]) -> list[SoundingObject]:
        """Adds all objects, or none if one is refused; `metadata["index"]` of the error is its place. An object is a
        model, or the arguments of `add` by name, such as {"model": bell, "handle": 3, "gain": 0.5}."""
        requests = []
        for i, item in enumerate(objects):
            if isinstance(item, Mapping):
                checks.refuse_unknown(item, ADD_ARGUMENTS, f"object {i} of add_all")
            requests.append(self._request(**item) if isinstance(item, Mapping) else self._request(item))
        request = scene_service_pb2.AddObjectsRequest(scene=self.name, objects=requests)
        with errors.translated(self.client.server):
            return [SoundingObject(self, item) for item in self.client.scenes_stub.AddObjects(request).objects]

    def add(self, model: materials.ModelLike | str, material: Optional[materials.Material] = None, *, size: float = 1,
            gain: float = 1, pose: Optional[PoseLike] = None, handle: int = 0,
            radiation: Optional[materials.Radiation] = None) -> SoundingObject:
        """Adds an object, ready to be struck. Without a material it gets the one that the model was asked for with.
        `gain` is linear, as in SoundingObject.update."""
        request = self._request(model, material, size=size, gain=gain, pose=pose, handle=handle, radiation=radiation)
        with errors.translated(self.client.server):
            return SoundingObject(self, self.client.scenes_stub.AddObject(request).object)

    def _request(self, model: materials.ModelLike | str, material: Optional[materials.Material] = None, *,
                 size: float = 1, gain: float = 1, pose: Optional[PoseLike] = None, handle: int = 0,
                 radiation: Optional[materials.Radiation] = None) -> scene_service_pb2.AddObjectRequest:
        name, message = materials.named(model, material)
        return checks.message(scene_service_pb2.AddObjectRequest, "add", dict(
            scene=self.name, modal_model=name, material=message, size=size, gain=gain, handle=handle,
            pose=None if pose is None else contacts.to_pose(pose), radiation=materials.to_radiation(radiation)))

    def objects(self) -> list[SoundingObject]:
        """Returns the objects of the scene by their handles."""
        with errors.translated(self.client.server):
            answer = self.client.scenes_stub.ListObjects(scene_service_pb2.ListObjectsRequest(scene=self.name))
        return [SoundingObject(self, item) for item in answer.objects]

    def update(self, *, gain: Optional[float] = None, muted: Optional[bool] = None,
               solo: Optional[bool] = None) -> scene_service_pb2.Scene:
        """Changes the volume within 30 ms, and returns the scene's state. `gain` is a linear factor: 1 keeps the level,
        and 10 ** (x / 20) changes it by x decibels. A `muted` scene rings on unheard. If you set `solo` for some of
        your scenes, the others are not heard."""
        request = checks.message(scene_service_pb2.UpdateSceneRequest, "update", dict(
            name=self.name, gain=gain, muted=muted, solo=solo))
        with errors.translated(self.client.server):
            return self.client.scenes_stub.UpdateScene(request).scene

    def stop(self) -> None:
        """Fades out all that sounds in the scene. Later contacts sound."""
        with errors.translated(self.client.server):
            self.client.scenes_stub.StopAll(scene_service_pb2.StopAllRequest(scene=self.name))

    def listen(self, seconds: float) -> Sound:
        """Records the scene alone, before the gain and the limiter of the output."""
        with self.client.recording(scene=self.name) as record:
            return record.take(seconds)

    @contextlib.contextmanager
    def recording_contacts(self) -> Iterator[TraceRecording]:
        """Has the daemon record the next stream of contacts that begins within the block. After the stream's end,
        `take` of what the block gets returns its trace, which renders to the same samples."""
        request = contact_service_pb2.RecordContactsRequest(scene=self.name)
        with errors.translated(self.client.server):
            answers = self.client.contacts_stub.RecordContacts(request)
            with self.client.cancellable(answers):
                next(answers)  # it has begun
                yield TraceRecording(answers, self.client.server)

    def move_listener(self, pose: PoseLike, glide: float = 0) -> None:
        """Moves the listener, within `glide` seconds."""
        request = scene_service_pb2.UpdateListenerRequest(
            scene=self.name, pose=contacts.to_pose(pose), glide_s=checks.number(glide, "glide", "seconds"))
        with errors.translated(self.client.server):
            self.client.scenes_stub.UpdateListener(request)

    def stream(self, step: float, delay: Optional[float] = None, *, frame: Optional[contacts.Frame] = None,
               pulse_shape: Optional[contacts.PulseShape] = None) -> ContactStream:
        """Opens a stream for the contacts of a simulation whose steps last `step` seconds. They sound `delay` seconds
        later, by default as soon as the network allows without jitter. `frame` "scene" means that points and impulses
        are in the scene's frame: the daemon turns them into the objects' by their poses, which the steps send."""
        if not (isinstance(step, numbers.Real) and 1e-6 <= step <= 1):
            checks.refuse(step, "step", "the step of the simulator, from 1e-6 to 1 s")
        return ContactStream(self, contact_service_pb2.ContactStreamStart(
            scene=self.name, step_s=step, scheduling_delay_s=delay, frame=contacts.to_frame(frame),
            pulse_shape=contacts.to_pulse_shape(pulse_shape)))

    def delete(self) -> None:
        """Deletes the scene and fades out its objects."""
        with errors.translated(self.client.server):
            self.client.scenes_stub.DeleteScene(scene_service_pb2.DeleteSceneRequest(name=self.name))

    def __enter__(self) -> Scene:
        return self

    def __exit__(self, kind: Any, *_: Any) -> None:
        try:
            self.delete()
        except errors.CarillonError as error:
            # The scene is gone already, or an exception of the caller is on its way, which says more.
            if error.reason != "SCENE_NOT_FOUND" and kind is None:
                raise


class TraceRecording:
    """A stream of contacts that the daemon records."""

    def __init__(self, answers: Any, server: str):
        self._answers = answers
        self._server = server

    def take(self) -> Trace:
        """Waits until the stream has ended. Returns its trace."""
        with errors.translated(self._server):
            return Trace.of(answer.record for answer in self._answers)

    def cancel(self) -> None:
        """Ends the recording."""
        self._answers.cancel()


def _refuse_other_scenes(columns: Contacts | Impulses | Forces | Poses | None, scene: str) -> None:
    """Raises ValueError for an object of another scene, where its handle may mean another object."""
    for name, other in contacts.scenes_of_objects(columns):
        if other != scene:
            raise ValueError(f"{name} has an object of {other}, and this is a stream of {scene}; give objects of that "
                             "scene")


class _OpenStreams:
    """The streams that are not closed. When the program ends, it warns as at the end of each of them."""

    def __init__(self) -> None:
        self.streams: set[ContactStream] = set()
        atexit.register(self.warn)
        os.register_at_fork(after_in_child=self.leave)

    def leave(self) -> None:
        """Closes the streams in a forked process, where no thread sends their steps."""
        for stream in list(self.streams):
            stream._end()

    def warn(self) -> None:
        for stream in list(self.streams):
            stream._warn_of_end()


_open_streams = _OpenStreams()


class ContactStream:
    """Sends the contacts of each step without waiting for the daemon: a thread sends them, and another reads the
    answers. `report` is the newest answer, with the counts so far. It counts an impulse as accepted before it sounds:
    one that is due after the scene is deleted is never heard, for which `report.ahead_s` says how long to wait after
    the end. `dropped_step_count` steps were not sent: the oldest ones, when more than 4096 waited. At the end of the
    block one ContactWarning tells of contacts that were late (`late_count`), lost or rejected and of time that was
    mapped anew (`remap_count`), and another of contacts that lie far from their objects."""

    def __init__(self, scene: Scene, start: contact_service_pb2.ContactStreamStart):
        self._server = scene.client.server
        self._start = start
        self._steps: queue.SimpleQueue[Optional[contact_pb2.ContactStep]] = queue.SimpleQueue()
        self._error: Optional[grpc.RpcError] = None
        self._is_closed = False
        self.report: contact_service_pb2.StreamContactsResponse = contact_service_pb2.StreamContactsResponse()
        self.dropped_step_count = 0
        self._step_count, self._time_s = 0, 0.0
        self._answers = scene.client.contacts_stub.StreamContacts(self._sent(start))
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        _open_streams.streams.add(self)

    @property
    def findings(self) -> contact_pb2.ContactFindings:
        """What the daemon found out about the contacts so far, such as blow_count and distant_point_count."""
        return self.report.findings

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

    def step(self, time: float, *, contacts: Optional[Contacts] = None, impulses: Optional[Impulses] = None,
             forces: Optional[Forces] = None, poses: Optional[Poses] = None,
             listener: Optional[PoseLike] = None) -> None:
        """Sends a step at a simulation time, seconds: the contacts that an engine reports, in every step; strikes;
        loads of a simulator that knows them; poses of objects, and of the listener. Errors as those of `send`."""
        for columns in (contacts, impulses, forces, poses):
            _refuse_other_scenes(columns, self._start.scene)
        self.send(make_step(time, contacts=contacts, impulses=impulses, forces=forces, poses=poses, listener=listener))

    def send(self, step: contact_pb2.ContactStep) -> None:
        """Sends a message of contact.proto. Raises CarillonError if the stream has failed or has been closed
        (CONTACT_STREAM_ENDED), and if the step's time goes back, or is over 1e10 s before or after 0 (INVALID_STREAM);
        such a step is not sent, and the stream can go on."""
        if self._is_closed:
            raise errors.CarillonError("CONTACT_STREAM_ENDED", "this stream has been closed, so that the step would "
                                       "not sound; open another one by Scene.stream")
        if self._error:
            _open_streams.streams.discard(self)
            raise errors.from_rpc(self._error, self._server)
        contacts.refuse_time(step.time_s, self._step_count, self._time_s, "open another stream for another run")
        self._step_count, self._time_s = self._step_count + 1, step.time_s
        if self._steps.qsize() >= MOST_WAITING:
            with contextlib.suppress(queue.Empty):  # the thread that sends may have taken it meanwhile
                self._steps.get_nowait()
                self.dropped_step_count += 1
        self._steps.put(step)

    def close(self, warn: bool = True) -> contact_service_pb2.StreamContactsResponse:
        """Waits until the daemon has taken all steps. Returns the last report."""
        self._end()
        self._steps.put(None)
        self._reader.join()
        if self._error:
            raise errors.from_rpc(self._error, self._server)
        if warn:
            errors.warn_of_stream(self.report, contacts.frame_in_words(self._start.frame), self.dropped_step_count)
        return self.report

    def _warn_of_end(self) -> None:
        """Warns that the stream was not closed, and of its contacts that did not sound as the caller meant."""
        errors.warn_of_open_stream(self._start.scene)
        errors.warn_of_stream(self.report, contacts.frame_in_words(self._start.frame), self.dropped_step_count)

    def _end(self) -> None:
        self._is_closed = True
        _open_streams.streams.discard(self)

    def _sent(self, start: contact_service_pb2.ContactStreamStart
              ) -> Iterator[contact_service_pb2.StreamContactsRequest]:
        yield contact_service_pb2.StreamContactsRequest(start=start)
        step = self._steps.get()
        while step is not None:
            steps, following = self._take_waiting(step)
            if len(steps) > 1:
                yield contact_service_pb2.StreamContactsRequest(steps=contact_service_pb2.ContactSteps(steps=steps))
            else:
                yield contact_service_pb2.StreamContactsRequest(step=step)
            step = following[0] if following else self._steps.get()

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

    def _read(self) -> None:
        try:
            for answer in self._answers:
                self.report = answer
        except grpc.RpcError as error:
            self._error = error
            self._steps.put(None)  # ends the thread that sends

    def __repr__(self) -> str:
        report = self.report
        return (f"<ContactStream of {self._start.scene}: {checks.counted(report.step_count, 'step')}, "
                f"{checks.counted(report.accepted_count, 'contact')} in time, {report.late_count} late, "
                f"{report.rejected_count} rejected>")

    def __enter__(self) -> ContactStream:
        return self

    def __exit__(self, kind: Any, *_: Any) -> None:
        if kind is not None:
            self._end()
            self._answers.cancel()
            self._reader.join()
        else:
            self.close()
