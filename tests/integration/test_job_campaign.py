# SPDX-License-Identifier: Apache-2.0
"""Many jobs, a third of them bad in every way, beside a sounding scene.

CARILLON_JOBS says how many (500 is the whole campaign), CARILLON_SEED repeats one.
"""

import functools
import importlib.util
import os
import pathlib
import random
import statistics
import subprocess
import tempfile
import threading
import time
import unittest

import meshes
import scripted
from carillon.v1 import audio_service_pb2, contact_pb2, decomposition_pb2
from carillon.v1 import decomposition_service_pb2, error_pb2, material_pb2, modal_model_pb2
from carillon.v1 import scene_service_pb2
from daemon import ROOT, Daemon
from google.protobuf.internal.encoder import _VarintBytes

JOB_COUNT = int(os.environ.get("CARILLON_JOBS", "24"))
SEED = int(os.environ.get("CARILLON_SEED", "0")) or random.SystemRandom().getrandbits(32)
MATERIAL = material_pb2.Material(preset=meshes.MATERIAL)

# What a worker does by the number of nodes it is asked for, modulo ten; how its job must end.
KINDS = {
    "good": (0, None),
    "refused": (1, "MESH_NOT_CLOSED"),
    "crashes": (2, "WORKER_CRASHED"),
    "eats memory": (4, "OUT_OF_MEMORY"),
    "floods its pipe": (5, "WORKER_CRASHED"),
    "takes too long": (6, "TIMEOUT"),
    "is cancelled": (7, "cancelled"),
}
BAD = [kind for kind in KINDS if kind != "good"]
WORKER = """
case $((nodes % 10)) in
  0) sleep 0.01; cp "$here/bar.model" "$out" ;;
  1) cat "$here/refusal" >&3; exit 2 ;;
  2) kill -SEGV $$ ;;
  4) x=0123456789abcdef; while :; do x=$x$x; done ;;
  5) while :; do cat "$here/flood" >&3; done ;;
  *) while :; do cat "$here/progress" >&3; sleep 0.1; done ;;
esac
"""


@functools.cache
def worker_messages():
    """The messages of workers, which no client has."""
    with tempfile.TemporaryDirectory(prefix="carillon-") as folder:
        subprocess.run(["protoc", "-I", ROOT / "proto", f"--python_out={folder}", "carillon/worker/v1/worker.proto"],
                       check=True)
        described = importlib.util.spec_from_file_location("worker_pb2", f"{folder}/carillon/worker/v1/worker_pb2.py")
        module = importlib.util.module_from_spec(described)
        described.loader.exec_module(module)
        return module


def event(**fields):
    message = worker_messages().WorkerEvent(**fields).SerializeToString()
    return _VarintBytes(len(message)) + message


class Scene(threading.Thread):
    """Strikes a bar again and again until it is stopped."""

    def __init__(self, client, model):
        super().__init__()
        self.client, self.stopped = client, threading.Event()
        self.scene = client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        self.handle = client.scenes.AddObjects(scene_service_pb2.AddObjectsRequest(
            scene=self.scene,
            objects=[scene_service_pb2.NewObject(modal_model=model, material=MATERIAL)])).objects[0].handle

    def run(self):
        impulse = contact_pb2.Contact(
            kind=contact_pb2.CONTACT_KIND_IMPACT, object=self.handle, point_m=contact_pb2.Vec3(z=meshes.BAR_SIZE[2]),
            impulse_newton_seconds=contact_pb2.Vec3(z=-0.001))
        while not self.stopped.wait(0.2):
            self.client.strike(self.scene, [impulse])

    def stop(self):
        self.stopped.set()
        self.join()


class JobCampaign(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        scripted.make_model(self.folder)
        (self.folder / "refusal").write_bytes(
            event(error=error_pb2.ErrorInfo(reason="MESH_NOT_CLOSED", message="as told")))
        progress = event(progress=decomposition_pb2.Progress(fraction=0.5))
        (self.folder / "progress").write_bytes(progress)
        (self.folder / "flood").write_bytes(progress * 10_000)
        self.daemon = Daemon(self.folder, "--precompute", scripted.worker(self.folder, WORKER),
                             "--workers", 4, "--memory-budget-mib", 2000, "--job-memory-mib", 60)
        self.addCleanup(self.daemon.stop)
        self.client = self.daemon.client()
        self.mesh = self.client.upload(meshes.bar())
        self.rng = random.Random(SEED)
        self.cancel_s = []

    def create(self, number, kind):
        settings = modal_model_pb2.DecompositionSettings(mesh=modal_model_pb2.MeshSettings(
            target_node_count=1000 + 10 * number + KINDS[kind][0]))
        return self.client.create(meshes.bar(), "obj", material=MATERIAL, settings=settings,
                                  time_limit_s=1 if kind == "takes too long" else 0)

    def cancel_once_it_runs(self, job):
        """Cancels a job and says how long its end took to come."""
        request = decomposition_service_pb2.WatchJobRequest(name=job.name)
        begun = None
        for answer in self.client.jobs.WatchJob(request):
            if answer.job.state == decomposition_pb2.JOB_STATE_RUNNING and begun is None:
                begun = time.monotonic()
                self.client.jobs.CancelJob(decomposition_service_pb2.CancelJobRequest(name=job.name))
        self.cancel_s.append(time.monotonic() - begun)

    def end_of(self, job):
        *_, last = self.client.jobs.WatchJob(
            decomposition_service_pb2.WatchJobRequest(name=job.name))
        if last.job.state == decomposition_pb2.JOB_STATE_CANCELLED:
            return "cancelled"
        return last.job.error.reason or None

    def xrun_count(self):
        return self.client.audio.GetMixer(audio_service_pb2.GetMixerRequest()).xrun_count

    def children(self):
        """(all, zombies) of the daemon's children."""
        pid, states = self.daemon.process.pid, []
        for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
            try:
                fields = stat.read_text().rsplit(")", 1)[1].split()
            except OSError:
                continue
            if int(fields[1]) == pid:
                states.append(fields[0])
        return len(states), states.count("Z")

    def test_every_verdict_is_right_and_the_sound_goes_on(self):
        scene = Scene(self.daemon.client(), self.client.wait(self.create(0, "good")))
        xruns = self.xrun_count()
        scene.start()
        self.addCleanup(scene.stop)
        kinds = [self.rng.choice(BAD) if i % 3 == 0 else "good" for i in range(JOB_COUNT)]
        self.rng.shuffle(kinds)
        jobs = [(kind, self.create(1 + i, kind)) for i, kind in enumerate(kinds)]
        cancellers = [threading.Thread(target=self.cancel_once_it_runs, args=(job,))
                      for kind, job in jobs if kind == "is cancelled"]
        for canceller in cancellers:
            canceller.start()
        wrong = [(kind, end) for kind, end in ((kind, self.end_of(job)) for kind, job in jobs)
                 if end != KINDS[kind][1]]
        for canceller in cancellers:
            canceller.join()
        xruns = self.xrun_count() - xruns
        self.assertEqual(wrong, [])
        self.assertEqual(self.children(), (0, 0))
        self.assertEqual(scripted.processes_of(self.folder / "data/work"), [])
        slowest = f"{1000 * max(self.cancel_s):.0f} ms, median {1000 * statistics.median(self.cancel_s):.0f}" \
            if self.cancel_s else "none"
        print(f"\nseed {SEED}: {len(jobs)} jobs, {len([k for k in kinds if k != 'good'])} bad, "
              f"{len(jobs) - len(wrong)} verdicts right, 0 zombies, 0 orphans, {xruns} xruns; "
              f"slowest cancel {slowest}")
        # A machine that builds and tests at the same time may starve any thread now and then.
        if "CARILLON_JOBS" in os.environ:
            self.assertEqual(xruns, 0)


if __name__ == "__main__":
    unittest.main()
