# SPDX-License-Identifier: Apache-2.0
"""A client that lives again and again: `python3 churning_client.py SERVER MODEL SEED`.

In each life it makes a scene, strikes, and also listens, renders, lists or submits a job. It prints a line for each
life. In 3 % of them it kills itself amid its streams, without a word to the daemon.
"""

import contextlib
import os
import random
import signal
import sys
import time
import traceback

import grpc

import meshes
import strike
from carillon.v1 import (
    audio_service_pb2, contact_pb2, contact_service_pb2, contact_trace_pb2, decomposition_service_pb2, material_pb2,
    modal_model_pb2, modal_model_service_pb2, scene_service_pb2)

MATERIAL = material_pb2.Material(preset=meshes.MATERIAL)
DEATHS = 0.03
STEPS = 10
STEP_S = 0.05


@contextlib.contextmanager
def telling():
    """Prints the error of an act, of which gRPC says only that the requests have ended."""
    try:
        yield
    except Exception:
        traceback.print_exc()
        raise


class Churning:
    def __init__(self, server, model, seed):
        self.server = server
        self.model = model
        self.random = random.Random(int(seed))

    def live(self):
        self.client = strike.Client(self.server)
        dies = self.random.random() < DEATHS
        scene = self.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        handle = self.client.scenes.AddObjects(scene_service_pb2.AddObjectsRequest(
            scene=scene,
            objects=[scene_service_pb2.NewObject(modal_model=self.model, material=MATERIAL)])).objects[0].handle
        act = self.random.choice((self.listen, self.render, self.list, self.submit, self.listen))
        for _ in self.client.contacts.StreamContacts(self.steps(scene, handle, dies, act)):
            pass
        self.client.scenes.DeleteScene(scene_service_pb2.DeleteSceneRequest(name=scene))

    def step(self, number, handle):
        impulse = contact_pb2.Contact(
            kind=contact_pb2.CONTACT_KIND_IMPACT, object=handle, point_m=contact_pb2.Vec3(z=meshes.BAR_SIZE[2]),
            impulse_newton_seconds=contact_pb2.Vec3(z=-self.random.uniform(1e-4, 1e-3)))
        return contact_pb2.ContactStep(time_s=number * STEP_S, contacts=[impulse])

    def steps(self, scene, handle, dies, act):
        request = contact_service_pb2.StreamContactsRequest
        yield request(start=contact_service_pb2.ContactStreamStart(scene=scene, step_s=STEP_S))
        last = self.random.randrange(STEPS)
        for number in range(STEPS):
            yield request(steps=[self.step(number, handle)])
            if number == last:
                with telling():
                    act(dies)
            time.sleep(STEP_S)

    def die(self):
        os.kill(os.getpid(), signal.SIGKILL)

    def listen(self, dies):
        stream = self.client.audio.Listen(audio_service_pb2.ListenRequest())
        for count, _ in enumerate(stream):
            if count == 20:
                break
        if dies:
            self.die()
        stream.cancel()

    def render(self, dies):
        record = contact_trace_pb2.ContactTraceRecord
        records = [record(header=contact_trace_pb2.ContactTraceHeader(format_version=1, step_s=STEP_S)),
                   record(object=contact_trace_pb2.ContactTraceObject(
                       handle=1, modal_model=self.model, material=MATERIAL)),
                   *(record(step=self.step(number, 1)) for number in range(20))]
        requests = [audio_service_pb2.RenderRequest(settings=audio_service_pb2.RenderSettings(tail_s=1)),
                    *(audio_service_pb2.RenderRequest(record=one) for one in records)]
        try:
            for _ in self.client.audio.Render(iter(requests)):
                if dies:
                    self.die()
        except grpc.RpcError as error:
            # More clients render than the daemon serves at once.
            if error.code() != grpc.StatusCode.RESOURCE_EXHAUSTED:
                raise

    def list(self, dies):
        list(self.client.list())
        self.client.jobs.ListJobs(decomposition_service_pb2.ListJobsRequest())
        self.client.scenes.ListScenes(scene_service_pb2.ListScenesRequest())
        self.client.audio.GetMixer(audio_service_pb2.GetMixerRequest())
        if dies:
            self.die()

    def submit(self, dies):
        """A small job, which is cancelled, or followed to its end; its model is deleted."""
        job = self.client.create(
            meshes.bar(), "obj", material=MATERIAL, settings=modal_model_pb2.DecompositionSettings(
                mesh=modal_model_pb2.MeshSettings(target_node_count=self.random.randrange(300, 340))))
        if dies:
            self.die()
        cancels = self.random.random() < 0.5
        with contextlib.suppress(strike.Refused, grpc.RpcError):  # another client may have cancelled or deleted it
            if cancels:
                self.client.jobs.CancelJob(decomposition_service_pb2.CancelJobRequest(name=job.name))
                return
            self.client.models.DeleteModalModel(
                modal_model_service_pb2.DeleteModalModelRequest(name=self.client.wait(job)))


def main():
    churning = Churning(*sys.argv[1:])
    while True:
        churning.live()
        print("lived", flush=True)


if __name__ == "__main__":
    main()
