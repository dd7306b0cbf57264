# SPDX-License-Identifier: Apache-2.0
"""The client: all calls of a connection."""

from __future__ import annotations

import contextlib
import os
from collections.abc import AsyncGenerator, Iterable
from typing import Any, Generic, Optional

from carillon import checks, errors, job_calls, meshes, models, progress, rendering
from carillon import materials as material_calls
from carillon.connection import CREDENTIALS, Connection
from carillon.contacts import Frame, PoseLike, PulseShape, to_pose
from carillon.faces import BlockingBlock, call, finished, items
from carillon.jobs import AnyJob, Job, JobCalls
from carillon.materials import Material
from carillon.models import AnyModel, Model
from carillon.performing import AnyPerformance, Microphone, Performance, settings_of
from carillon.recordings import AnyRecording, Recording, heard
from carillon.scenes import AnyScene, Scene
from carillon.settings import Settings, Unit, to_settings
from carillon.sound import Sound
from carillon.traces import Trace
from carillon.v1 import (
    audio_service_pb2, decomposition_service_pb2, hearing_pb2, material_pb2, modal_model_service_pb2, scene_service_pb2,
    server_service_pb2)

PIECE_BYTES = 1 << 20


def connect(server: Optional[str] = None, *, tls_roots: str | os.PathLike[str] | None = None,
            **credentials: Any) -> Client:
    """Connects to a daemon: "unix:PATH" or "HOST:PORT", by default where default_server() says. `tls_roots` is the
    PEM file with the certificates that vouch for a daemon with TLS. Over TCP the daemon may want to know the caller, by
    `token` (default: $CARILLON_TOKEN), or by the PEM files `tls_certificate` and `tls_key`. Raises CarillonError
    (TLS_REQUIRED) if a token would cross the network without TLS."""
    checks.refuse_unknown(credentials, CREDENTIALS, "connect")
    return Client(server, tls_roots=tls_roots, **credentials)


class ClientCalls(Connection, Generic[AnyModel, AnyJob, AnyScene, AnyRecording, AnyPerformance]):
    """A connection, as a context manager closed at the end. The attributes *_stub are all services of the contract
    but AdminService, for calls that have no method here."""

    _model_kind: type[AnyModel]
    _job_kind: type[AnyJob]
    _scene_kind: type[AnyScene]
    _recording_kind: type[AnyRecording]
    _performance_kind: type[AnyPerformance]

    @call
    async def info(self) -> server_service_pb2.GetServerInfoResponse:
        """Returns the version, the age, the limits and the features of the daemon. Needs no token."""
        return await self.ask(self.server_stub.GetServerInfo, server_service_pb2.GetServerInfoRequest())

    @call
    async def status(self) -> audio_service_pb2.GetMixerResponse:
        """Returns the state of the daemon's mixer and output."""
        return await self.ask(self.audio_stub.GetMixer, audio_service_pb2.GetMixerRequest())

    @call
    async def upload(self, mesh: Any) -> str:
        """Stores a mesh (see carillon.meshes.to_mesh_file). Returns its digest."""
        data = meshes.to_mesh_file(mesh).data
        pieces = (modal_model_service_pb2.UploadMeshRequest(data=data[i:i + PIECE_BYTES])
                  for i in range(0, len(data), PIECE_BYTES))
        return (await self.ask(self.models_stub.UploadMesh, pieces)).mesh_digest

    @call
    async def create_job(self, /, mesh: Any, material: Material, *, label: Optional[str] = None,
                         unit: Optional[Unit] = None, accuracy: Optional[float] = None, settings: Settings = None,
                         **request: Any) -> AnyJob:
        """Asks for the model of a mesh and does not wait for it. `unit` is that of its coordinates: "m", "cm", "mm",
        "in", or a number of metres. `accuracy` is the largest estimated error of a frequency, such as 0.01 for 1 %.
        `settings` has other fields of DecompositionSettings, and `request` those of CreateModalModelRequest, such as
        size, max_frequency_hz, priority or coarse_first."""
        file = meshes.to_mesh_file(mesh)
        message = checks.message(modal_model_service_pb2.CreateModalModelRequest, "create_model", dict(
            mesh_format=file.format, material=material_calls.to_message(material),
            label=file.label if label is None else label, settings=to_settings(settings, unit, accuracy), **request),
            more=("unit", "accuracy", "progress_bar"))
        message.mesh_digest = await ClientCalls.upload(self, file)
        answer = await self.ask(self.models_stub.CreateModalModel, message)
        return self._job_kind(self, answer.job, material, label or "")

    @call
    async def create_model(self, /, mesh: Any, material: Material, *, progress_bar: progress.Progress = None,
                           **request: Any) -> AnyModel:
        """Returns the model of a mesh, which is computed if the daemon does not have it. `mesh` is a file, a pair
        (vertices, triangles), or an object of trimesh or Open3D; `request` as for create_job, and `progress_bar` as for
        Job.wait."""
        job = await ClientCalls.create_job(self, mesh, material, **request)
        return await JobCalls.wait(job, progress_bar)

    @call
    async def model(self, text: str, material: Optional[Material] = None) -> AnyModel:
        """Returns the model that the text means: a name, a label, or the first digits of a digest."""
        return self._model_kind(self, await models.find(self, text), material)

    @items
    async def models(self, /, **filters: Any) -> AsyncGenerator[AnyModel, None]:
        """Yields the models that match, newest first, a page at a time; filters are fields of
        ListModalModelsRequest, such as label_contains or tag."""
        async for summary in models.listed(self, filters):
            yield self._model_kind(self, summary)

    @items
    async def watch_jobs(self, states: Iterable[str] = (),
                         label_contains: str = "") -> AsyncGenerator[Optional[AnyJob], None]:
        """Yields the jobs that wait or run, then None, and then each job after every change, new ones too. The loop
        goes on until it is left. Only jobs in the `states`, such as "failed", and with this text in their label
        come."""
        request = decomposition_service_pb2.WatchJobsRequest(states=job_calls.to_states(states),
                                                             label_contains=label_contains)
        async for answer in self.answers(self.jobs_stub.WatchJobs, request):
            yield self._job_kind(self, answer.job) if answer.HasField("job") else None

    @items
    async def jobs(self, states: Iterable[str] = (), label_contains: str = "") -> AsyncGenerator[AnyJob, None]:
        """Yields the jobs, newest first: those in the `states`, such as "failed", and with this text in their label."""
        async for job in job_calls.listed(self, states, label_contains):
            yield self._job_kind(self, job)

    @call
    async def resolve(self, material: Material) -> material_pb2.Material:
        """Replaces the name of a material by its figures."""
        return await material_calls.resolve(self, material)

    @call
    async def set_volume(self, *, gain: Optional[float] = None,
                         muted: Optional[bool] = None) -> audio_service_pb2.UpdateMixerResponse:
        """Changes the gain of the daemon's output, or mutes it, without a click. The gain is a linear factor: 1
        keeps the level, and 10 ** (x / 20) changes it by x decibels. The answer has the gain and whether the output is
        muted."""
        request = checks.message(audio_service_pb2.UpdateMixerRequest, "set_volume", dict(gain=gain, muted=muted))
        return await self.ask(self.audio_stub.UpdateMixer, request)

    @call
    async def stop_all(self) -> int:
        """Fades out all that sounds in your scenes. Returns their number."""
        return (await self.ask(self.scenes_stub.StopAll, scene_service_pb2.StopAllRequest())).scene_count

    @call
    async def scene(self, /, *, hearing: Optional[hearing_pb2.Hearing] = None, listener: Optional[PoseLike] = None,
                    gain: Optional[float] = None, keep: bool = False, id: str = "", **unknown: Any) -> AnyScene:
        """Makes an empty scene with a linear `gain`. It ends by itself a minute after its clients, unless `keep` is
        true. With an `id`, such as "lathe-1", it is "scenes/lathe-1"; a scene that you made before with this id and the
        same settings is returned as it is, and its `existing` is true. A HearingWarning tells of a `hearing` with
        panning or two ears whose daemon plays one channel."""
        request = checks.message(scene_service_pb2.CreateSceneRequest, "scene", dict(
            hearing=hearing, listener=None if listener is None else to_pose(listener, "listener"), gain=gain, keep=keep,
            id=id, **unknown))
        made = await self.ask(self.scenes_stub.CreateScene, request)
        if request.hearing.panning or request.hearing.binaural:
            await self._warn_of_one_channel(made.name)
        return self._scene_kind(self, made.name, made.existing)

    async def _warn_of_one_channel(self, scene: str) -> None:
        """Warns if the daemon plays one channel. A caller who may not ask for its output gets no warning."""
        with contextlib.suppress(errors.CarillonError):
            if (await ClientCalls.status(self)).format.channel_count == 1:
                errors.warn_of_one_channel(scene)

    @call
    async def scenes(self) -> list[AnyScene]:
        """Returns all scenes of the daemon, the oldest first."""
        answer = await self.ask(self.scenes_stub.ListScenes, scene_service_pb2.ListScenesRequest())
        return [self._scene_kind(self, item.name) for item in answer.scenes]

    @call
    async def render(self, /, trace: Trace | str | os.PathLike[str], *, normalize: bool = False,
                     timeout: Optional[float] = None, **settings: Any) -> Sound:
        """Renders a trace, or a .contacts file, faster than real time unless live sound and decompositions need the
        processors, to which a rendering yields. `settings` are fields of RenderSettings: sample_rate_hz, channel_count,
        tail_s, longest_s, gain, full_scale_pa and tell_blows. `normalize` gives the sound a peak of 0.9. A sound that
        peaks below -40 dB of full scale, or that the limiter changed, is then rendered again with a full scale a little
        above its peak, unless `full_scale_pa` is given, because modes end at -140 dB of full scale. Raises
        CarillonError if a contact is rejected, if there is none (TRACE_EMPTY), or if the rendering has not ended after
        `timeout` seconds (DEADLINE_EXCEEDED)."""
        whole = trace if isinstance(trace, Trace) else Trace.read(trace)
        return await rendering.render(self, whole, settings, normalize, timeout)

    @call
    async def listen(self, seconds: float) -> Sound:
        """Records what the daemon plays."""
        return await heard(self._recording_kind(self, {}), seconds)

    def perform(self, *, step: float, environments: int = 1, microphones: Iterable[Microphone] = (),
                latency: float = 0, frame: Optional[Frame] = None, pulse_shape: Optional[PulseShape] = None,
                **settings: Any) -> AnyPerformance:
        """Performs environments that are simulated in step, each heard by the `microphones`: within the block each
        `step` of this many seconds gives its samples before the next. `latency` is the time from a contact to its
        sound, 0 to 0.1 seconds. `settings` are fields of PerformSettings: sample_rate_hz, full_scale_pa, hearing and
        tell_impacts."""
        return self._performance_kind(self, settings_of(step, environments, microphones, latency, frame, pulse_shape,
                                                        settings))

    def recording(self, **request: Any) -> AnyRecording:
        """Records what the daemon plays within the block, from its first line on. `request` has fields of
        ListenRequest: scene, block_frame_count and encoding."""
        return self._recording_kind(self, request)

    @call
    async def close(self) -> None:
        """Ends the connection."""
        await self._close()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.server}>"


class Client(BlockingBlock, ClientCalls[Model, Job, Scene, Recording, Performance]):
    __doc__ = ClientCalls.__doc__
    _model_kind, _job_kind, _scene_kind, _recording_kind = Model, Job, Scene, Recording
    _performance_kind = Performance

    @property
    def materials(self) -> dict[str, material_pb2.Material]:
        """The catalogue of materials by name."""
        return finished(material_calls.catalogue(self))
