#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Strikes a mesh and hears it: a whole Carillon client, written from the .proto files alone.

There is no SDK beneath it, only what protoc makes of proto/carillon/v1 (see README.md here), so it
also shows what a client in any other language has to do.
"""

import argparse
import array
import collections
import os
import pathlib
import sys
import wave

import grpc
from carillon.v1 import (
    audio_service_pb2, audio_service_pb2_grpc, contact_pb2, contact_service_pb2,
    contact_service_pb2_grpc, decomposition_pb2, decomposition_service_pb2,
    decomposition_service_pb2_grpc, error_pb2, hearing_pb2, material_pb2, modal_model_service_pb2,
    modal_model_service_pb2_grpc, scene_service_pb2, scene_service_pb2_grpc)

PIECE_BYTES = 1 << 20

Sound = collections.namedtuple("Sound", "sample_rate_hz channel_count samples lost_frame_count")


class Refused(Exception):
    """What a call or a job was refused for: an ErrorInfo."""

    def __init__(self, info):
        super().__init__(f"{info.reason}: {info.message}")
        self.info = info


def refusal(error):
    """The Refused in a grpc.RpcError: its rich status is in the trailing metadata."""
    details = error_pb2.StatusDetails()
    info = error_pb2.ErrorInfo(reason=error.code().name, message=error.details())
    for key, value in error.trailing_metadata() or ():
        if key == "grpc-status-details-bin":
            details.ParseFromString(value)
    for detail in details.details:
        detail.Unpack(info)
    return Refused(info)


class Bearer(grpc.UnaryUnaryClientInterceptor, grpc.UnaryStreamClientInterceptor,
             grpc.StreamUnaryClientInterceptor, grpc.StreamStreamClientInterceptor):
    """Sends the token by which the daemon knows a caller over TCP with each call."""

    def __init__(self, token):
        self.item = ("authorization", f"Bearer {token}")

    def intercept(self, proceed, details, request):
        return proceed(details._replace(metadata=[*(details.metadata or ()), self.item]), request)

    intercept_unary_unary = intercept_unary_stream = intercept
    intercept_stream_unary = intercept_stream_stream = intercept


class Client:
    """One channel, a stub for each service."""

    def __init__(self, server):
        channel = grpc.insecure_channel(server)
        if token := os.environ.get("CARILLON_TOKEN"):
            if not server.startswith(("unix:", "localhost:", "127.0.0.1:", "[::1]:")):
                sys.exit(f"strike.py: without TLS the token would cross the network to {server} in clear")
            channel = grpc.intercept_channel(channel, Bearer(token))
        self.models = modal_model_service_pb2_grpc.ModalModelServiceStub(channel)
        self.jobs = decomposition_service_pb2_grpc.DecompositionServiceStub(channel)
        self.scenes = scene_service_pb2_grpc.SceneServiceStub(channel)
        self.contacts = contact_service_pb2_grpc.ContactServiceStub(channel)
        self.audio = audio_service_pb2_grpc.AudioServiceStub(channel)

    def upload(self, data):
        """Stores a mesh file; returns its digest."""
        pieces = (modal_model_service_pb2.UploadMeshRequest(data=data[i:i + PIECE_BYTES])
                  for i in range(0, len(data), PIECE_BYTES))
        return self.models.UploadMesh(pieces).mesh_digest

    def create(self, data, mesh_format, **request):
        """Asks for the modal model of a mesh file; returns the job."""
        return self.models.CreateModalModel(modal_model_service_pb2.CreateModalModelRequest(
            mesh_digest=self.upload(data), mesh_format=mesh_format, **request)).job

    def list(self, **filters):
        """Yields the models that match, newest first, a page at a time; all without a filter."""
        request = modal_model_service_pb2.ListModalModelsRequest(**filters)
        while True:
            page = self.models.ListModalModels(request)
            yield from page.modal_models
            if not page.next_page_token:
                return
            request.page_token = page.next_page_token

    def wait(self, job, on_change=lambda job: None):
        """Follows a job to its end; returns the name of its model."""
        for answer in self.jobs.WatchJob(decomposition_service_pb2.WatchJobRequest(name=job.name)):
            job = answer.job
            on_change(job)
        if job.state != decomposition_pb2.JOB_STATE_SUCCEEDED:
            raise Refused(job.error)
        return job.modal_model

    def strike(self, scene, impacts):
        """Strikes objects of a scene at once, without a delay; returns the daemon's counts."""
        start = contact_service_pb2.ContactStreamStart(scene=scene, step_s=0.001,
                                                       scheduling_delay_s=0)
        step = contact_pb2.ContactStep(contacts=impacts)
        *_, last = self.contacts.StreamContacts(iter((
            contact_service_pb2.StreamContactsRequest(start=start),
            contact_service_pb2.StreamContactsRequest(steps=[step]))))
        if last.rejected_count:
            raise Refused(last.last_rejection)
        return last

    def listen(self, seconds, on_start=lambda: None):
        """Hears so many seconds of what the daemon plays; `on_start` is called once it hears."""
        stream = self.audio.Listen(audio_service_pb2.ListenRequest())
        audio_format = next(stream).format
        wanted = int(seconds * audio_format.sample_rate_hz) * audio_format.channel_count
        samples, lost = array.array("f"), 0
        on_start()
        for answer in stream:
            samples.frombytes(answer.block.samples)
            lost = answer.lost_frame_count
            if len(samples) >= wanted:
                break
        stream.cancel()
        if sys.byteorder == "big":
            samples.byteswap()
        return Sound(audio_format.sample_rate_hz, audio_format.channel_count, samples[:wanted], lost)


def write_wave(path, sound):
    """Writes 16-bit samples."""
    pcm = array.array("h", (round(32767 * max(-1.0, min(1.0, s))) for s in sound.samples))
    if sys.byteorder == "big":
        pcm.byteswap()
    with wave.open(str(path), "wb") as out:
        out.setnchannels(sound.channel_count)
        out.setsampwidth(2)
        out.setframerate(sound.sample_rate_hz)
        out.writeframes(pcm.tobytes())


def loudest_frequency_hz(sound):
    """Returns the frequency at which the first channel is loudest, or None without numpy."""
    try:
        import numpy
    except ImportError:
        return None
    channel = numpy.array(sound.samples[::sound.channel_count])
    spectrum = numpy.abs(numpy.fft.rfft(channel * numpy.hanning(len(channel))))
    return float(numpy.argmax(spectrum)) * sound.sample_rate_hz / len(channel)


def show_progress(job):
    phase = decomposition_pb2.Phase.Name(job.progress.phase).removeprefix("PHASE_").lower()
    print(f"\r{job.progress.fraction:4.0%} {phase:<12}", end="", file=sys.stderr, flush=True)


def strike_and_listen(client, model, options):
    """Puts the model into a scene, strikes it, hears it."""
    # Without `at` it is heard as if the listener were a metre away, whatever the direction.
    hearing = hearing_pb2.Hearing(distance_gain=True, propagation_delay=True, panning=True)
    pose = contact_pb2.Pose(position_m=contact_pb2.Vec3(**dict(zip("xyz", options.at or ()))))
    scene = client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest(
        hearing=hearing if options.at else None)).name
    try:
        added = client.scenes.AddObjects(scene_service_pb2.AddObjectsRequest(
            scene=scene, objects=[scene_service_pb2.NewObject(
                modal_model=model, material=material_pb2.Material(preset=options.material),
                pose=pose if options.at else None)]))
        impulse = contact_pb2.Contact(
            kind=contact_pb2.CONTACT_KIND_IMPACT, object=added.objects[0].handle,
            point_m=contact_pb2.Vec3(**dict(zip("xyz", options.point))),
            impulse_newton_seconds=contact_pb2.Vec3(**dict(zip("xyz", options.impulse))),
            duration_s=options.duration, hertz=contact_pb2.HertzContact(striker=options.striker))
        print(f"{added.objects[0].sounding_mode_count} modes sound, the lowest at "
              f"{added.objects[0].lowest_frequency_hz:.2f} Hz")
        return client.listen(options.seconds, on_start=lambda: client.strike(scene, [impulse]))
    finally:
        client.scenes.DeleteScene(scene_service_pb2.DeleteSceneRequest(name=scene))


def run(options):
    client = Client(options.server)
    job = client.create(options.mesh.read_bytes(), options.mesh.suffix.lstrip(".").lower(),
                        material=material_pb2.Material(preset=options.material),
                        label=options.mesh.stem)
    model = client.wait(job, show_progress)
    print(f"\n{model}")
    sound = strike_and_listen(client, model, options)
    write_wave(options.out, sound)
    peak = max(map(abs, sound.samples))
    frequency = loudest_frequency_hz(sound)
    print(f"{options.out}: peak {peak:.4f}"
          + (f", loudest at {frequency:.1f} Hz" if frequency else "")
          + (f", {sound.lost_frame_count} frames lost" if sound.lost_frame_count else ""))


def vector(text):
    x, y, z = map(float, text.split(","))
    return x, y, z


def default_server():
    """Where the daemon listens when nobody says; see proto/README.md."""
    folder = os.environ.get("XDG_RUNTIME_DIR")
    folder = f"{folder}/carillon" if folder else f"/tmp/carillon-{os.getuid()}"
    return os.environ.get("CARILLON_SERVER") or f"unix:{folder}/carillond.sock"


def main():
    parser = argparse.ArgumentParser(description="Strikes a mesh and hears it.")
    parser.add_argument("mesh", type=pathlib.Path, help="surface in metres: OBJ, PLY, STL or OFF")
    parser.add_argument("--point", type=vector, required=True, help="where: x,y,z in m")
    parser.add_argument("--impulse", type=vector, required=True, help="how hard: x,y,z in N s")
    parser.add_argument("--striker", default="steel",
                        help="steel, wood, rubber, felt or fingertip (default: %(default)s)")
    parser.add_argument("--duration", type=float,
                        help="of the contact, s (default: that of an elastic collision)")
    parser.add_argument("--at", type=vector, help="where it is: x,y,z in m from a listener who looks "
                        "along -z; to the right of him is +x")
    parser.add_argument("--material", default="chime_aluminum")
    parser.add_argument("--seconds", type=float, default=2)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("strike.wav"))
    parser.add_argument("--server", default=default_server())
    try:
        run(parser.parse_args())
    except grpc.RpcError as error:
        sys.exit(f"strike.py: {refusal(error)}")
    except Refused as error:
        sys.exit(f"strike.py: {error}")


if __name__ == "__main__":
    main()
