# SPDX-License-Identifier: Apache-2.0
"""The connection to a daemon."""

from __future__ import annotations

import contextlib
import contextvars
import functools
import os
import pathlib
import threading
from collections.abc import Iterable, Iterator
from typing import Any, Optional

import grpc
import numpy

from carillon import checks, contacts, errors, forks, meshes, progress, summaries
from carillon.address import default_server, is_local
from carillon.authorization import authorized
from carillon.contacts import PoseLike, to_pose
from carillon.jobs import Job, to_states
from carillon.materials import Material, resolved, to_message
from carillon.models import Model
from carillon.scenes import Scene
from carillon.settings import Settings, Unit, to_settings
from carillon.sound import Sound
from carillon.traces import Trace
from carillon.v1 import (
    admin_service_pb2_grpc, audio_service_pb2, audio_service_pb2_grpc, contact_service_pb2_grpc,
    decomposition_service_pb2, decomposition_service_pb2_grpc, hearing_pb2, material_pb2, modal_model_service_pb2,
    modal_model_service_pb2_grpc, scene_service_pb2, scene_service_pb2_grpc,
    server_service_pb2, server_service_pb2_grpc)

PIECE_BYTES = 1 << 20
LEAST_FULL_SCALE_PA = 0.00002

# The calls that carillon.aio cancels when its task is cancelled.
running_calls: contextvars.ContextVar[Optional[list[Any]]] = contextvars.ContextVar("running_calls", default=None)


def connect(server: Optional[str] = None, *, tls_roots: str | os.PathLike[str] | None = None,
            **credentials: Any) -> Client:
    """Connects to a daemon: "unix:PATH" or "HOST:PORT", by default where default_server() says. `tls_roots` is the
    PEM file with the certificates that vouch for a daemon with TLS. Over TCP the daemon may want to know the caller, by
    `token` (default: $CARILLON_TOKEN), or by the PEM files `tls_certificate` and `tls_key`."""
    checks.refuse_unknown(credentials, ("tls_roots", "token", "tls_certificate", "tls_key"), "connect")
    address = server or default_server()
    if address.startswith("/") or address.lower().startswith(("http://", "https://")):
        checks.refuse(address, "server", '"unix:PATH" or "HOST:PORT"')
    return Client(address, tls_roots, **credentials)


class Client:
    """A connection, as a context manager closed at the end. The attributes *_stub are the services of the contract,
    for calls that have no method here."""

    def __init__(self, server: str, tls_roots: str | os.PathLike[str] | None = None, *, token: Optional[str] = None,
                 tls_certificate: str | os.PathLike[str] | None = None,
                 tls_key: str | os.PathLike[str] | None = None):
        self.server = server
        token = token or os.environ.get("CARILLON_TOKEN")
        if token and tls_roots is None and not is_local(server):
            raise errors.CarillonError("TLS_REQUIRED", f"the token would cross the network to {server} in clear; give "
                                       "tls_roots, or the address of a daemon on this machine, or no token")
        options = [("grpc.max_receive_message_length", -1)]
        if is_local(server):
            options.append(("grpc.enable_http_proxy", 0))  # a proxy reaches another machine than this one
        if tls_roots is None:
            self._make_channel = lambda: authorized(grpc.insecure_channel(server, options), token)
        else:
            roots, key, certificate = (path and pathlib.Path(path).read_bytes()
                                       for path in (tls_roots, tls_key, tls_certificate))
            credentials = grpc.ssl_channel_credentials(roots, key, certificate)
            self._make_channel = lambda: authorized(grpc.secure_channel(server, credentials, options), token)
        forks.open_in_children(self)
        self.reopen()

    def reopen(self) -> None:
        """Opens a new connection, as a process does that was forked."""
        self._channel = self._make_channel()
        self.models_stub = modal_model_service_pb2_grpc.ModalModelServiceStub(self._channel)
        self.jobs_stub = decomposition_service_pb2_grpc.DecompositionServiceStub(self._channel)
        self.scenes_stub = scene_service_pb2_grpc.SceneServiceStub(self._channel)
        self.contacts_stub = contact_service_pb2_grpc.ContactServiceStub(self._channel)
        self.audio_stub = audio_service_pb2_grpc.AudioServiceStub(self._channel)
        self.server_stub = server_service_pb2_grpc.ServerServiceStub(self._channel)
        self.admin_stub = admin_service_pb2_grpc.AdminServiceStub(self._channel)

    def info(self) -> server_service_pb2.GetServerInfoResponse:
        """Returns the version, the age, the limits and the features of the daemon. Needs no token."""
        with errors.translated(self.server):
            return self.server_stub.GetServerInfo(server_service_pb2.GetServerInfoRequest())

    def status(self) -> audio_service_pb2.GetMixerResponse:
        """Returns the state of the daemon's mixer and output."""
        with errors.translated(self.server):
            return self.audio_stub.GetMixer(audio_service_pb2.GetMixerRequest())

    def upload(self, mesh: Any) -> str:
        """Stores a mesh (see carillon.meshes.to_mesh_file). Returns its digest."""
        data = meshes.to_mesh_file(mesh).data
        pieces = (modal_model_service_pb2.UploadMeshRequest(data=data[i:i + PIECE_BYTES])
                  for i in range(0, len(data), PIECE_BYTES))
        with errors.translated(self.server):
            return self.models_stub.UploadMesh(pieces).mesh_digest

    def create_job(self, mesh: Any, material: Material, *, label: Optional[str] = None, unit: Optional[Unit] = None,
                   accuracy: Optional[float] = None, settings: Settings = None, **request: Any) -> Job:
        """Asks for the model of a mesh and does not wait for it. `unit` is that of its coordinates: "m", "cm", "mm",
        "in", or a number of metres. `accuracy` is the largest estimated error of a frequency, such as 0.01 for 1 %.
        `settings` has other fields of DecompositionSettings, and `request` those of CreateModalModelRequest, such as
        size, max_frequency_hz, priority or coarse_first."""
        file = meshes.to_mesh_file(mesh)
        message = checks.message(modal_model_service_pb2.CreateModalModelRequest, "create_model", dict(
            mesh_format=file.format, material=to_message(material), label=file.label if label is None else label,
            settings=to_settings(settings, unit, accuracy), **request), more=("unit", "accuracy", "progress_bar"))
        message.mesh_digest = self.upload(file)
        with errors.translated(self.server):
            return Job(self, self.models_stub.CreateModalModel(message).job, material, label or "")

    def create_model(self, mesh: Any, material: Material, *, progress_bar: progress.Progress = None,
                     **request: Any) -> Model:
        """Returns the model of a mesh, which is computed if the daemon does not have it. `mesh` is a file, a pair
        (vertices, triangles), or an object of trimesh or Open3D; `request` as for create_job."""
        return self.create_job(mesh, material, **request).wait(progress_bar)

    def model(self, text: str, material: Optional[Material] = None) -> Model:
        """Returns the model that the text means: a name, a label, or the first digits of a digest."""
        if not isinstance(text, str) or not text.removeprefix("modalModels/"):
            checks.refuse(text, "the model", "its label, its name, or the first digits of its digest")
        name = text if text.startswith("modalModels/") else self._find(text).name
        with errors.translated(self.server):
            answer = self.models_stub.GetModalModel(modal_model_service_pb2.GetModalModelRequest(name=name))
        return Model(self, answer.modal_model, material)

    def models(self, **filters: Any) -> Iterator[Model]:
        """Yields the models that match, newest first, a page at a time; filters are fields of
        ListModalModelsRequest, such as label_contains or tag."""
        request = checks.message(modal_model_service_pb2.ListModalModelsRequest, "models", filters)
        while True:
            with errors.translated(self.server):
                page = self.models_stub.ListModalModels(request)
            yield from (Model(self, summary) for summary in page.modal_models)
            if not page.next_page_token:
                return
            request.page_token = page.next_page_token

    def watch_jobs(self, states: Iterable[str] = (), label_contains: str = "") -> Iterator[Optional[Job]]:
        """Yields the jobs that wait or run, then None, and then each job after every change, new ones too. The loop
        goes on until it is left. Only jobs in the `states`, such as "failed", and with this text in their label
        come."""
        request = decomposition_service_pb2.WatchJobsRequest(states=to_states(states), label_contains=label_contains)
        with errors.translated(self.server):
            answers = self.jobs_stub.WatchJobs(request)
            with self.cancellable(answers):
                for answer in answers:
                    yield Job(self, answer.job) if answer.HasField("job") else None

    def jobs(self, states: Iterable[str] = (), label_contains: str = "") -> Iterator[Job]:
        """Yields the jobs, newest first: those in the `states`, such as "failed", and with this text in their label."""
        request = decomposition_service_pb2.ListJobsRequest(states=to_states(states), label_contains=label_contains)
        while True:
            with errors.translated(self.server):
                page = self.jobs_stub.ListJobs(request)
            yield from (Job(self, job) for job in page.jobs)
            if not page.next_page_token:
                return
            request.page_token = page.next_page_token

    @functools.cached_property
    def materials(self) -> dict[str, material_pb2.Material]:
        """The catalogue of materials by name."""
        with errors.translated(self.server):
            answer = self.models_stub.ListMaterials(modal_model_service_pb2.ListMaterialsRequest())
        return {item.name: item.material for item in answer.materials}

    def resolve(self, material: Material) -> material_pb2.Material:
        """Replaces the name of a material by its figures."""
        message = to_message(material)
        if message.preset and message.preset not in self.materials:
            raise errors.CarillonError("UNKNOWN_MATERIAL", f"there is no material \"{message.preset}\"; "
                                       + (checks.suggestion(message.preset, self.materials)
                                          or "Client.materials has all of them"))
        return resolved(message, self.materials)

    def set_volume(self, *, gain: Optional[float] = None,
                   muted: Optional[bool] = None) -> audio_service_pb2.UpdateMixerResponse:
        """Changes the gain of the daemon's output, or mutes it, without a click. The gain is a linear factor: 1
        keeps the level, and 10 ** (x / 20) changes it by x decibels. The answer has the gain and whether the output is
        muted."""
        request = checks.message(audio_service_pb2.UpdateMixerRequest, "set_volume", dict(gain=gain, muted=muted))
        with errors.translated(self.server):
            return self.audio_stub.UpdateMixer(request)

    def stop_all(self) -> int:
        """Fades out all that sounds in your scenes. Returns their number."""
        with errors.translated(self.server):
            return self.scenes_stub.StopAll(scene_service_pb2.StopAllRequest()).scene_count

    def scene(self, *, hearing: Optional[hearing_pb2.Hearing] = None, listener: Optional[PoseLike] = None,
              gain: Optional[float] = None, keep: bool = False, id: str = "", **unknown: Any) -> Scene:
        """Makes an empty scene with a linear `gain`. It ends by itself a minute after its clients, unless `keep` is
        true. With an `id`, such as "lathe-1", it is "scenes/lathe-1"; a scene that you made before with this id and the
        same settings is returned as it is, and its `existing` is true."""
        request = checks.message(scene_service_pb2.CreateSceneRequest, "scene", dict(
            hearing=hearing, listener=None if listener is None else to_pose(listener, "listener"), gain=gain, keep=keep,
            id=id, **unknown))
        with errors.translated(self.server):
            made = self.scenes_stub.CreateScene(request)
        return Scene(self, made.name, made.existing)

    def scenes(self) -> list[Scene]:
        """Returns all scenes of the daemon, the oldest first."""
        with errors.translated(self.server):
            answer = self.scenes_stub.ListScenes(scene_service_pb2.ListScenesRequest())
        return [Scene(self, item.name) for item in answer.scenes]

    def render(self, trace: Trace | str | os.PathLike[str], *, normalize: bool = False, **settings: Any) -> Sound:
        """Renders a trace, or a .contacts file, faster than real time. `settings` are fields of RenderSettings:
        sample_rate_hz, channel_count, tail_s, gain, full_scale_pa and tell_blows. `normalize` gives the sound a peak of
        0.9. A sound that peaks below -40 dB of full scale, or that the limiter changed, is then rendered again with a
        full scale a little above its peak, unless `full_scale_pa` is given, because tails end at -80 dB of full scale.
        Raises CarillonError if a contact is rejected, or if there is none (TRACE_EMPTY)."""
        whole = trace if isinstance(trace, Trace) else Trace.read(trace)
        sound = self._render(whole, settings)
        if not normalize:
            return sound
        summary = sound.summary
        if (summary and "full_scale_pa" not in settings
                and (0 < summary.peak < 0.01 or summary.limited_frame_count > 0)):
            settings["full_scale_pa"] = max(1.5 * summary.peak_pa, LEAST_FULL_SCALE_PA)
            sound = self._render(whole, settings)
        return sound.normalized()

    def listen(self, seconds: float) -> Sound:
        """Records what the daemon plays."""
        with self.recording() as record:
            return record.take(seconds)

    @contextlib.contextmanager
    def recording(self, **request: Any) -> Iterator[Recording]:
        """Records what the daemon plays within the block, from its first line on. `request` has fields of
        ListenRequest: scene, block_frame_count and encoding."""
        with errors.translated(self.server):
            answers = self.audio_stub.Listen(checks.message(audio_service_pb2.ListenRequest, "recording", request))
            with self.cancellable(answers):
                record = Recording(answers, self.server)
                try:
                    yield record
                finally:
                    record.stop()

    @contextlib.contextmanager
    def cancellable(self, call: Any) -> Iterator[None]:
        """Cancels a call at the end of the block, and lets carillon.aio cancel it before."""
        calls = running_calls.get()
        if calls is not None:
            calls.append(call)
        try:
            yield
        finally:
            call.cancel()

    def __repr__(self) -> str:
        return f"<Client of {self.server}>"

    def close(self) -> None:
        self._channel.close()

    def _find(self, text: str) -> Model:
        models = list(self.models())
        found = [model for model in models
                 if model.label == text or model.name.removeprefix("modalModels/").startswith(text)]
        if len(found) == 1:
            return found[0]
        if found:
            raise errors.CarillonError("MODAL_MODEL_AMBIGUOUS", f"'{text}' means {len(found)} of the models, for "
                                       f"instance {found[0].name} and {found[1].name}; give more digits of the digest")
        hint = checks.suggestion(text, {model.label for model in models if model.label})
        raise errors.CarillonError("MODAL_MODEL_NOT_FOUND", f"no model has the label '{text}' or begins with these "
                                   "digits" + (f"; {hint}" if hint else ""))

    def _render(self, trace: Trace, given: dict[str, Any]) -> Sound:
        request = audio_service_pb2.RenderRequest
        settings = checks.message(audio_service_pb2.RenderSettings, "render", given)

        def requests() -> Iterator[audio_service_pb2.RenderRequest]:
            yield request(settings=settings)
            yield from (request(record=record) for record in trace.records())

        blocks, rate_hz, channels, summary = [], 0, 1, audio_service_pb2.RenderSummary()
        blows: list[audio_service_pb2.Blow] = []
        with errors.translated(self.server):
            answers = self.audio_stub.Render(requests())
            with self.cancellable(answers):
                for answer in answers:
                    kind = answer.WhichOneof("response")
                    if kind == "format":
                        rate_hz, channels = answer.format.sample_rate_hz, answer.format.channel_count
                    elif kind == "block":
                        blocks.append(answer.block.samples)
                    elif kind == "blows":
                        blows.extend(answer.blows.blows)
                    else:
                        summary = answer.summary
        if summary.rejected_count:
            raise errors.from_info(summary.last_rejection)
        summaries.refuse_without_contacts(summary)
        errors.warn_of_contacts(summary.findings, contacts.frame_in_words(trace.header.frame), summary.accepted_count)
        if summary.paper_coupling_object_count:
            self._warn_of_transfers({item.modal_model for item in trace.objects})
        samples = numpy.frombuffer(b"".join(blocks), "<f4").reshape(-1, channels)
        return Sound(samples, rate_hz, summary=summary, blows=tuple(blows))

    def _warn_of_transfers(self, models: set[str]) -> None:
        """Warns if transfers of the models are being computed. A caller who may not list jobs gets no warning."""
        labels = []
        with contextlib.suppress(errors.CarillonError):
            labels = [job.message.label or job.name for job in self.jobs(["queued", "running"])
                      if job.is_transfer and job.message.modal_model in models]
        if labels:
            errors.warn_of_transfers(labels)

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()


class Recording:
    """What the daemon plays; a thread collects it. `sound` is what was heard so far."""

    def __init__(self, answers: Any, server: str):
        self._answers = answers
        self._server = server
        self._format = next(answers).format
        self._short = self._format.encoding == audio_service_pb2.AUDIO_ENCODING_INT16
        self._blocks: list[bytes] = []
        self._frame_count = self._lost = 0
        self._error: Optional[grpc.RpcError] = None
        self._more = threading.Condition()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def sound(self) -> Sound:
        with self._more:
            samples = numpy.frombuffer(b"".join(self._blocks), "<i2" if self._short else "<f4")
        if self._short:
            samples = samples.astype("<f4") / 32767
        return Sound(samples.reshape(-1, self._format.channel_count), self._format.sample_rate_hz, self._lost)

    def take(self, seconds: float) -> Sound:
        """Waits until this much of the sound since the beginning was heard, and returns it. Raises CarillonError if the
        recording ends before."""
        if not seconds > 0:
            checks.refuse(seconds, "seconds", "more than 0")
        wanted = int(seconds * self._format.sample_rate_hz)
        with self._more:
            self._more.wait_for(lambda: self._frame_count >= wanted or self._error)
        if self._error:
            raise errors.from_rpc(self._error, self._server)
        heard = self.sound
        return Sound(heard.samples[:wanted], heard.sample_rate_hz, heard.lost_frame_count)

    def stop(self) -> None:
        self.cancel()
        self._reader.join()

    def cancel(self) -> None:
        """Ends the recording and does not wait for it."""
        self._answers.cancel()

    def _read(self) -> None:
        try:
            for answer in self._answers:
                with self._more:
                    self._blocks.append(answer.block.samples)
                    self._frame_count += len(answer.block.samples) // (
                        (2 if self._short else 4) * self._format.channel_count)
                    self._lost = answer.lost_frame_count
                    self._more.notify_all()
        except grpc.RpcError as error:
            with self._more:
                self._error = error
                self._more.notify_all()
