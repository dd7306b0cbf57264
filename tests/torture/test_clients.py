# SPDX-License-Identifier: Apache-2.0
"""What clients leave behind when they die, and what one client can take from the others."""

import re
import selectors
import signal
import socket
import subprocess
import sys
import threading
import time
import unittest
import urllib.request

import grpc

import meshes
import torture
from carillon.v1 import (
    audio_service_pb2, audio_service_pb2_grpc, contact_pb2, contact_service_pb2, decomposition_pb2,
    decomposition_service_pb2, material_pb2, modal_model_pb2, modal_model_service_pb2, modal_model_service_pb2_grpc,
    scene_service_pb2, scene_service_pb2_grpc)

MATERIAL = material_pb2.Material(preset=meshes.MATERIAL)
SCENES = 512

# A client that makes scenes, the first with a stream of contacts, says so, and waits to be killed.
CLIENT = """
import sys, time
import strike
from carillon.v1 import contact_service_pb2, scene_service_pb2
client = strike.Client(sys.argv[1])
streams = []
def start(scene):
    yield contact_service_pb2.StreamContactsRequest(
        start=contact_service_pb2.ContactStreamStart(scene=scene, step_s=0.01))
    time.sleep(1000)
for _ in range(int(sys.argv[2])):
    scene = client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
    if not streams:
        streams.append(client.contacts.StreamContacts(start(scene)))
        next(streams[-1])
print("ready", flush=True)
time.sleep(1000)
"""


def free_port():
    with socket.socket() as bound:
        bound.bind(("127.0.0.1", 0))
        return bound.getsockname()[1]


class SilentConnections(threading.Thread):
    """Keeps `count` connections to a port that say nothing; each is replaced as soon as it is closed."""

    def __init__(self, port, count):
        super().__init__()
        self.port, self.count, self.closed_count = port, count, 0
        self.stopped = threading.Event()

    def run(self):
        with selectors.DefaultSelector() as selector:
            for _ in range(self.count):
                self.connect(selector)
            while not self.stopped.is_set():
                for key, _ in selector.select(0.1):
                    selector.unregister(key.fileobj)
                    key.fileobj.close()
                    self.closed_count += 1
                    self.connect(selector)
            for key in list(selector.get_map().values()):
                key.fileobj.close()

    def connect(self, selector):
        connection = socket.socket()
        connection.setblocking(False)
        connection.connect_ex(("127.0.0.1", self.port))
        selector.register(connection, selectors.EVENT_READ)

    def stop(self):
        self.stopped.set()
        self.join()


class Client:
    def __init__(self, server):
        channel = grpc.insecure_channel(server, [("grpc.use_local_subchannel_pool", 1)])
        self.scenes = scene_service_pb2_grpc.SceneServiceStub(channel)
        self.audio = audio_service_pb2_grpc.AudioServiceStub(channel)
        self.models = modal_model_service_pb2_grpc.ModalModelServiceStub(channel)
        self.close = channel.close


class ClientTest(torture.ServedTest):
    def another(self, server=None):
        """The stubs of a client with a connection of its own, which its `close` closes; over TCP it has a share of its
        own, too."""
        client = Client(server or self.daemon.server)
        self.addCleanup(client.close)
        return client

    def serve_over_tcp(self, *arguments):
        """Returns the address."""
        address = f"127.0.0.1:{free_port()}"
        self.serve("--listen", address, *arguments)
        return address

    def crash(self, clients, scenes):
        """So many clients at a time make so many scenes each, and are killed."""
        processes = [subprocess.Popen([sys.executable, "-c", CLIENT, self.daemon.server, str(scenes)],
                                      stdout=subprocess.PIPE, text=True) for _ in range(clients)]
        for process in processes:
            with process:
                self.assertEqual(process.stdout.readline(), "ready\n")
                process.send_signal(signal.SIGKILL)

    def scenes(self):
        return self.client.scenes.ListScenes(scene_service_pb2.ListScenesRequest()).scenes

    def create(self, **settings):
        return self.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest(**settings)).name

    def refused(self, call):
        with self.assertRaises(grpc.RpcError) as error:
            call()
        return error.exception.details().split(":")[0]

    def test_scenes_of_crashed_clients_end(self):
        self.serve("--scene-grace", "0.5")
        own = self.create()
        for _ in range(torture.rounds(1, 8)):
            self.crash(8, 8)
            ended_s = torture.wait_until(lambda: [scene.name for scene in self.scenes()] == [own], 30)
            print(f"64 scenes of 8 crashed clients ended after {ended_s:.2f} s", flush=True)
        self.assertIn("its clients have gone", (self.folder / "log").read_text())

    def test_crashed_clients_use_up_no_places_within_the_grace(self):
        self.serve("--scene-grace", "1000")
        for _ in range(torture.rounds(2, 3)):
            self.crash(1, SCENES // 2)
        self.assertEqual(len(self.scenes()), SCENES)
        torture.wait_until(lambda: all(scene.HasField("ends_in_s") for scene in self.scenes()), 30)
        own = [self.create() for _ in range(100)]
        names = [scene.name for scene in self.scenes()]
        self.assertEqual(names[-len(own):], own)
        self.assertEqual(len(names), SCENES)

    def test_a_client_that_comes_back_goes_on_with_its_scene(self):
        self.serve("--scene-grace", "1000")
        first = self.another()
        scene = first.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        self.assertEqual(self.scenes()[0].connection_count, 1)
        first.close()
        torture.wait_until(lambda: self.scenes()[0].HasField("ends_in_s"), 30)
        again = self.another()
        again.scenes.ListObjects(scene_service_pb2.ListObjectsRequest(scene=scene))
        self.assertTrue(self.scenes()[0].HasField("ends_in_s"))
        again.scenes.UpdateListener(scene_service_pb2.UpdateListenerRequest(scene=scene, pose=contact_pb2.Pose()))
        self.assertFalse(self.scenes()[0].HasField("ends_in_s"))
        self.assertEqual(self.scenes()[0].connection_count, 1)

    def test_a_scene_that_is_kept_is_listed_as_such(self):
        self.serve("--scene-grace", "0")
        client = self.another()
        kept = client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest(keep=True)).name
        client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest())
        client.close()
        torture.wait_until(lambda: [scene.name for scene in self.scenes()] == [kept], 30)
        self.assertEqual(self.daemon.command("scene", "list").stdout, f"{kept}  0 objects  gain 1  kept\n")

    def test_one_client_does_not_shut_out_others(self):
        tcp = self.serve_over_tcp()
        taken = [self.create() for _ in range(SCENES // 2)]
        self.assertEqual(self.refused(self.create), "CLIENT_LIMIT_REACHED")
        calls = [self.client.audio.Listen(audio_service_pb2.ListenRequest()) for _ in range(16)]
        for call in calls:
            next(call)
        self.assertEqual(self.refused(lambda: next(self.client.audio.Listen(audio_service_pb2.ListenRequest()))),
                         "CLIENT_LIMIT_REACHED")
        same = self.another()
        self.assertEqual(self.refused(lambda: same.scenes.CreateScene(scene_service_pb2.CreateSceneRequest())),
                         "CLIENT_LIMIT_REACHED")
        other = self.another(tcp)
        self.assertEqual(other.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name,
                         f"scenes/{len(taken) + 1}")
        next(other.audio.Listen(audio_service_pb2.ListenRequest()))
        self.client.scenes.DeleteScene(scene_service_pb2.DeleteSceneRequest(name=taken[0]))
        self.create()

    def test_a_flood_of_urgent_jobs_does_not_hold_up_another_client(self):
        tcp = self.serve_over_tcp("--workers", "1")
        mesh_digest = self.client.upload(meshes.bar())

        def request(priority, nodes):
            return modal_model_service_pb2.CreateModalModelRequest(
                mesh_digest=mesh_digest, mesh_format="obj", material=MATERIAL, priority=priority,
                settings=modal_model_pb2.DecompositionSettings(
                    mesh=modal_model_pb2.MeshSettings(target_node_count=nodes)))
        reason = None
        for nodes in range(2000, 2600):
            try:
                self.client.models.CreateModalModel(request(100, nodes))
            except grpc.RpcError as error:
                reason = error.details().split(":")[0]
                break
        self.assertEqual(reason, "CLIENT_LIMIT_REACHED")
        other = self.another(tcp)
        begin_s = time.monotonic()
        self.client.wait(other.models.CreateModalModel(request(0, 500)).job)
        taken_s = time.monotonic() - begin_s
        jobs = self.client.jobs.ListJobs(decomposition_service_pb2.ListJobsRequest(page_size=600)).jobs
        waiting = sum(job.state == decomposition_pb2.JOB_STATE_QUEUED for job in jobs)
        print(f"a job of priority 0 took {taken_s:.1f} s; {waiting} of 513 jobs of priority 100 wait still", flush=True)
        self.assertGreater(waiting, 500)

    def test_metrics_count_what_clients_do(self):
        self.serve("--metrics", f"127.0.0.1:{free_port()}")
        address = self.daemon.arguments[-1]

        def read():
            with urllib.request.urlopen(f"http://{address}/metrics", timeout=10) as answer:
                text = answer.read().decode()
            return dict(re.findall(r"^([a-z_]+(?:\{[^}]*\})?) (\S+)$", text, re.MULTILINE))
        before = read()
        self.assertEqual(before["carillon_scenes"], "0")
        self.assertEqual(before["carillon_device_playing"], "1")
        scene = torture.SoundingScene(self.daemon)
        try:
            torture.wait_until(lambda: float(read()['carillon_impulses_total{outcome="in_time"}']) > 0, 30)
            torture.wait_until(lambda: float(read()['carillon_modes{state="sounding"}']) > 0, 30)
            during = read()
        finally:
            scene.stop()
        self.assertEqual(during["carillon_scenes"], "1")
        self.assertEqual(during['carillon_calls{kind="contact_stream"}'], "1")
        self.assertEqual(during['carillon_calls{kind="listener"}'], "1")
        self.assertGreater(float(during["carillon_connections"]), 0)
        self.assertGreater(float(during["carillon_database_bytes"]), 0)
        self.assertGreater(float(during['carillon_jobs_ended_total{state="succeeded"}']), 0)
        bad = contact_pb2.Contact(kind=contact_pb2.CONTACT_KIND_IMPACT, object=99, point_m=contact_pb2.Vec3(),
                                  impulse_newton_seconds=contact_pb2.Vec3(x=1))
        list(self.client.contacts.StreamContacts(iter([
            contact_service_pb2.StreamContactsRequest(
                start=contact_service_pb2.ContactStreamStart(scene=scene.scene, step_s=0.01)),
            contact_service_pb2.StreamContactsRequest(steps=[contact_pb2.ContactStep(contacts=[bad])])])))
        self.assertEqual(read()['carillon_impulses_rejected_total{reason="OBJECT_NOT_FOUND"}'], "1")

    def test_metrics_are_read_within_prometheus_s_limit_beside_400_connections_that_say_nothing(self):
        port = free_port()
        self.serve("--metrics", f"127.0.0.1:{port}")
        silent = SilentConnections(port, 400)
        silent.start()
        self.addCleanup(silent.stop)
        torture.wait_until(lambda: silent.closed_count > 100, 60)
        taken_s = []
        for _ in range(3):
            begin_s = time.monotonic()
            # Prometheus waits for 10 s.
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=10) as answer:
                self.assertIn(b"carillon_build_info", answer.read())
            taken_s.append(time.monotonic() - begin_s)
        print(f"beside 400 silent connections the metrics were read in {max(taken_s):.1f} s", flush=True)
        self.assertLess(max(taken_s), 10)


if __name__ == "__main__":
    unittest.main()
