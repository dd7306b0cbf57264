# SPDX-License-Identifier: Apache-2.0
"""A thousand clients that strike four times a second each, alone and amid clients that mean no good."""

import contextlib
import itertools
import json
import os
import pathlib
import resource
import signal
import socket
import statistics
import subprocess
import threading
import time
import unittest

import grpc

import meshes
import torture
from carillon.v1 import audio_service_pb2, material_pb2, scene_service_pb2
from certificates import self_signed
from http2_frames import METHOD
from test_floods import Flood, resets

CROWD = pathlib.Path(os.environ["CARILLON_BUILD_DIR"], "tests", "crowd")
GOOD, SCENES = torture.rounds(40, 1000), torture.rounds(20, 500)
SILENT, HALF_OPEN = torture.rounds(100, 2000), torture.rounds(30, 600)
BAD_CROWDS, BAD_CLIENTS = torture.rounds(2, 10), 20
RUN_S = torture.rounds(3, 30)
DELAY_S = 0.05
# An attacker's own work, which on its own machine would take nothing from anybody, gets the cores last.
ATTACKERS_NICENESS = 19
MOST_LATE = 0.05
# The daemon takes large steps on a thread for each processor. gRPC has up to two executor threads for each.
MOST_OWN_THREADS = 16 + max(2, os.cpu_count())
MOST_THREADS = MOST_OWN_THREADS + 11 + 2 * os.cpu_count()
# gRPC begins a further timer thread when all of them are busy, and never ends one. They are busy when thousands of bad
# clients' connections end at a time: on two processors with other work, gRPC has had ten more threads then.
MOST_THREADS_AMID_BAD = MOST_THREADS + 16
# The first bytes of a TLS handshake: a record that says it is 512 bytes long.
HALF_HANDSHAKE = bytes([22, 3, 1, 2, 0, 1])
REST_S = torture.rounds(1, 60)


def threads_of(process):
    """The number of threads, and the number of those that gRPC has not named."""
    names = [file.read_text().strip() for file in pathlib.Path("/proc", str(process.pid), "task").glob("*/comm")]
    return len(names), names.count("carillond")


class Prober:
    """Calls the daemon fifty times a second, until it is stopped, and keeps how long each call took."""

    def __init__(self, server):
        self.channel = grpc.insecure_channel(server, [("grpc.use_local_subchannel_pool", 1)])
        self.call = self.channel.unary_unary(METHOD.decode(), audio_service_pb2.GetMixerRequest.SerializeToString,
                                             audio_service_pb2.GetMixerResponse.FromString)
        self.times_s = []
        self.stopped = threading.Event()
        self.thread = threading.Thread(target=self._run)
        self.call(audio_service_pb2.GetMixerRequest(), timeout=30)
        self.thread.start()

    def _run(self):
        while not self.stopped.wait(0.02):
            begin_s = time.monotonic()
            self.call(audio_service_pb2.GetMixerRequest(), timeout=30)
            self.times_s.append(time.monotonic() - begin_s)

    def stop(self):
        self.stopped.set()
        self.thread.join()
        self.channel.close()

    def percentile_99_s(self):
        return statistics.quantiles(self.times_s, n=100)[98]


class CrowdTest(torture.ServedTest):
    def setUp(self):
        super().setUp()
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 8192), hard))
        self.addCleanup(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        certificate, key = self_signed(self.folder)
        self.serve("--listen", "127.0.0.1:0", "--tls-certificate", certificate, "--tls-key", key, "--client-share", "1")
        self.port = int(self.daemon.listening[1].rsplit(":", 1)[1])
        model = self.client.wait(self.client.create(meshes.bar(), "obj",
                                                    material=material_pb2.Material(preset=meshes.MATERIAL)))
        self.targets = [word for _ in range(SCENES) for word in self.scene_with(model)]

    def scene_with(self, model):
        scene = self.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        added = self.client.scenes.AddObjects(scene_service_pb2.AddObjectsRequest(
            scene=scene,
            objects=[scene_service_pb2.NewObject(modal_model=model,
                material=material_pb2.Material(preset=meshes.MATERIAL), gain=0.01)]))
        return scene, str(added.objects[0].handle)

    def start_crowd(self, clients, seconds, targets):
        """The process, once all its streams are open."""
        crowd = subprocess.Popen([CROWD, self.daemon.server, str(clients), str(seconds), str(DELAY_S), *targets],
                                 stdout=subprocess.PIPE, text=True)
        self.addCleanup(crowd.stdout.close)
        self.addCleanup(crowd.wait)
        self.addCleanup(crowd.kill)
        self.assertEqual(crowd.stdout.readline(), "ready\n")
        return crowd

    def run_good(self, meanwhile=None):
        """The counts of the good clients, with the 99th percentile of other calls and the daemon's threads."""
        crowd = self.start_crowd(GOOD, RUN_S, self.targets)
        prober = Prober(self.daemon.server)
        self.addCleanup(prober.stop)
        if meanwhile is not None:
            meanwhile()
        counts = json.loads(crowd.stdout.readline())
        prober.stop()
        threads, own_threads = threads_of(self.daemon.process)
        counts.update(p99_ms=1e3 * prober.percentile_99_s(), threads=threads, own_threads=own_threads)
        return counts

    def silent(self, family, address, count, first=b""):
        made = []
        for _ in range(count):
            connection = socket.socket(family, socket.SOCK_STREAM)
            self.addCleanup(connection.close)
            connection.settimeout(2)
            with contextlib.suppress(OSError):
                connection.connect(address)
                connection.sendall(first)
            made.append(connection)
        return made

    def misbehave(self):
        thread = threading.get_native_id()
        before = os.getpriority(os.PRIO_PROCESS, thread)
        os.setpriority(os.PRIO_PROCESS, thread, ATTACKERS_NICENESS)  # its threads and processes inherit it
        try:
            self.attack()
        finally:
            with contextlib.suppress(PermissionError):
                os.setpriority(os.PRIO_PROCESS, thread, before)

    def attack(self):
        crowds = [self.start_crowd(BAD_CLIENTS, RUN_S, self.targets[:2]) for _ in range(BAD_CROWDS)]
        self.bad = [self.silent(socket.AF_UNIX, str(self.folder / "socket"), SILENT),
                    self.silent(socket.AF_INET, ("127.0.0.1", self.port), HALF_OPEN, HALF_HANDSHAKE)]
        self.flood = Flood(str(self.folder / "socket"), resets)
        self.addCleanup(self.flood.stop)
        for number, crowd in enumerate(crowds):
            crowd.send_signal(signal.SIGKILL if number % 2 else signal.SIGSTOP)

    def test_good_clients_are_served_amid_bad_ones(self):
        alone = self.run_good()
        before_mib = torture.resident_mib(self.daemon.process)
        amid = self.run_good(self.misbehave)
        self.flood.stop()
        for connection in itertools.chain(*self.bad):
            connection.close()
        time.sleep(REST_S)
        after_mib = torture.resident_mib(self.daemon.process)
        print(f"{GOOD} clients alone: {alone}; amid bad ones: {amid}; memory {before_mib:.0f} MiB, {REST_S} s after "
              f"{after_mib:.0f}", flush=True)
        for counts, most_threads in ((alone, MOST_THREADS), (amid, MOST_THREADS_AMID_BAD)):
            self.assertEqual((counts["failed"], counts["lost"]), (0, 0))
            self.assertEqual(counts["accepted"] + counts["late"], counts["sent"])
            self.assertGreater(counts["sent"], 0.9 * 4 * GOOD * RUN_S)
            self.assertLessEqual(counts["own_threads"], MOST_OWN_THREADS)
            self.assertLessEqual(counts["threads"], most_threads)
            if torture.LONG:
                self.assertLess(counts["late"], MOST_LATE * counts["sent"])
                self.assertLess(counts["p99_ms"], 1e3 * DELAY_S)
        if torture.LONG:
            self.assertLess(after_mib, 1.1 * before_mib)


if __name__ == "__main__":
    unittest.main()
