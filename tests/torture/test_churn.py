# SPDX-License-Identifier: Apache-2.0
"""Clients come and go, some without a word: the daemon's memory, descriptors, threads and places stay the same."""

import collections
import os
import pathlib
import re
import resource
import signal
import statistics
import subprocess
import sys
import threading
import time
import unittest
import urllib.request

import meshes
import torture
from carillon.v1 import material_pb2
from test_clients import free_port

CLIENTS = 20
RUN_S = 60 * float(os.environ.get("CARILLON_TORTURE_MINUTES") or torture.rounds(0.25, 10))
# Within this part of the run caches and thread pools fill.
WARM_UP = 0.4
# A run of ten minutes cannot tell a smaller slope from the noise of the allocator.
MEMORY_MIB_PER_HOUR = 20
LONG_ENOUGH_S = 600

Sample = collections.namedtuple("Sample", "time_s mib descriptors threads")


class Churn:
    """Clients that are started again when they have died, until `stop`."""

    def __init__(self, server, model):
        self.arguments = (server, model)
        self.lives = self.deaths = self.failures = 0
        self.lock = threading.Lock()
        self.stopped = False
        self.threads = [threading.Thread(target=self._run, args=(number,)) for number in range(CLIENTS)]
        for thread in self.threads:
            thread.start()

    def _run(self, number):
        seed = number
        while not self.stopped:
            with subprocess.Popen([sys.executable, pathlib.Path(__file__).with_name("churning_client.py"),
                                   *self.arguments, str(seed)], stdout=subprocess.PIPE, text=True) as process:
                for _ in process.stdout:
                    with self.lock:
                        self.lives += 1
                    if self.stopped:
                        process.terminate()
            seed += CLIENTS
            with self.lock:
                self.deaths += process.returncode == -signal.SIGKILL
                self.failures += process.returncode not in (-signal.SIGKILL, -signal.SIGTERM)

    def stop(self):
        self.stopped = True
        for thread in self.threads:
            thread.join()


def slope_per_hour(samples):
    """Of the memory, MiB/h, by the line of least squares."""
    if len(samples) < 2:
        return 0.0
    return 3600 * statistics.linear_regression([sample.time_s for sample in samples],
                                               [sample.mib for sample in samples]).slope


class ChurnTest(torture.ServedTest):
    def sample(self):
        process = pathlib.Path("/proc", str(self.daemon.process.pid))
        statm = (process / "statm").read_text().split()
        return Sample(time.monotonic(), int(statm[1]) * resource.getpagesize() / 2**20,
                      len(os.listdir(process / "fd")), len(os.listdir(process / "task")))

    def metrics(self):
        with urllib.request.urlopen(f"http://{self.daemon.arguments[-1]}/metrics", timeout=10) as answer:
            return dict(re.findall(r"^(carillon_[a-z_]+(?:\{[^}]*\})?) (\S+)$", answer.read().decode(), re.MULTILINE))

    def taken_places(self):
        wanted = ("carillon_scenes", "carillon_objects", "carillon_calls{", "carillon_jobs{")
        return {name: value for name, value in self.metrics().items() if name.startswith(wanted) and value != "0"}

    def churn(self, model):
        """Returns the samples of each second, and the churn that has ended."""
        churn = Churn(self.daemon.server, model)
        samples = []
        try:
            end_s = time.monotonic() + RUN_S
            while time.monotonic() < end_s:
                time.sleep(min(1.0, RUN_S / 20))
                samples.append(self.sample())
        finally:
            churn.stop()
        return samples, churn

    def test_nothing_grows_and_no_place_is_used_up(self):
        self.serve("--scene-grace", "1", "--metrics", f"127.0.0.1:{free_port()}")
        model = self.client.wait(self.client.create(
            meshes.bar(), "obj", material=material_pb2.Material(preset=meshes.MATERIAL)))
        before = self.sample()
        samples, churn = self.churn(model)
        torture.wait_until(lambda: not self.taken_places(), 60)
        warm = samples[int(WARM_UP * len(samples)):]
        first, last = warm[:len(warm) // 2], warm[len(warm) // 2:]
        after = self.sample()
        slope = slope_per_hour(warm)
        print(f"{churn.lives} lives, {churn.deaths} deaths without a word in {RUN_S:.0f} s; memory "
              f"{before.mib:.1f} MiB before, {warm[0].mib:.1f} warm, {warm[-1].mib:.1f} at the end, "
              f"{after.mib:.1f} after: {slope:+.1f} MiB/h", flush=True)
        for name in ("descriptors", "threads"):
            medians = [statistics.median(getattr(sample, name) for sample in part) for part in (first, last)]
            most = max(getattr(sample, name) for sample in samples)
            print(f"{name}: {getattr(before, name)} before, {medians[0]:g} then {medians[1]:g} amid, at most {most}, "
                  f"{getattr(after, name)} after", flush=True)
            self.assertLess(medians[1], 1.25 * medians[0] + 5)
            self.assertLess(getattr(after, name), getattr(before, name) + 2 * CLIENTS)
        self.assertGreater(churn.lives, CLIENTS)
        self.assertEqual(churn.failures, 0)
        if RUN_S >= LONG_ENOUGH_S:
            self.assertLess(slope, MEMORY_MIB_PER_HOUR)
            self.assertGreater(churn.deaths, 0)


if __name__ == "__main__":
    unittest.main()
