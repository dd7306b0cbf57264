# SPDX-License-Identifier: Apache-2.0
"""Clients come and go, some without a word: the daemon's memory, descriptors, threads and places stay the same."""

import collections
import os
import pathlib
import resource
import signal
import statistics
import subprocess
import sys
import threading
import time

import torture
from daemon import free_port, wait_until

CLIENTS = 20
RUN_S = 60 * float(os.environ.get("CARILLON_TORTURE_MINUTES") or torture.rounds(0.25, 10))
# The clients rest after each part of the run. What the daemon then still has is not in use.
PARTS = 2 if RUN_S < 300 else round(RUN_S / 150)
# The daemon gives freed memory back every 5 s.
REST_S = 12
# The test reads the metrics as often as a Prometheus server with a scrape interval of 5 s. Each of the 33 threads of
# the daemon's metrics server allocates its buffers when it answers for the first time.
SAMPLES_PER_SCRAPE = 5
# Caches and thread pools fill in the first part. The first connections and renderings of a daemon need these.
WARM_UP_MIB = 32
# Of the memory at rest after the first part.
GROWTH = 0.1
GROWTH_PER_HOUR = 0.01
# A shorter run cannot tell a smaller slope from the noise of the allocator, which is about 0.5 MiB.
LONG_ENOUGH_S = 600
NOISE_MIB = 0.5

Sample = collections.namedtuple("Sample", "time_s mib file_mib descriptors threads")


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
        resident, shared = (int(text) * resource.getpagesize() / 2**20
                            for text in (process / "statm").read_text().split()[1:3])
        return Sample(time.monotonic(), resident, shared,
                      len(os.listdir(process / "fd")), len(os.listdir(process / "task")))

    def taken_places(self):
        wanted = ("carillon_scenes", "carillon_objects", "carillon_calls{", "carillon_jobs{")
        return {name: value for name, value in self.daemon.metrics().items()
                if name.startswith(wanted) and value != "0"}

    def churn(self, model):
        """Runs the clients for one part and reads the metrics meanwhile; returns the samples of each second."""
        churn = Churn(self.daemon.server, model)
        samples = []
        try:
            end_s = time.monotonic() + RUN_S / PARTS
            while time.monotonic() < end_s:
                time.sleep(min(1.0, RUN_S / 20))
                samples.append(self.sample())
                if len(samples) % SAMPLES_PER_SCRAPE == 0:
                    self.daemon.metrics()
        finally:
            churn.stop()
        self.lives += churn.lives
        self.deaths += churn.deaths
        self.assertEqual(churn.failures, 0)
        return samples

    def rest(self):
        """Returns a sample when no call is left, no place is taken, and freed memory has been given back."""
        wait_until(lambda: not self.taken_places(), 60)
        time.sleep(REST_S)
        return self.sample()

    def allocated_mib(self):
        return float(self.daemon.metrics()["carillon_heap_bytes"]) / 2**20

    def check_memory(self, before, rests):
        growth_mib_per_hour = slope_per_hour(rests[len(rests) // 2:])
        print("memory at rest: " + ", ".join(f"{rest.mib:.1f}" for rest in (before, *rests))
              + f" MiB; {growth_mib_per_hour:+.1f} MiB/h in the second half", flush=True)
        self.assertLess(rests[0].mib, before.mib + WARM_UP_MIB)
        for rest in rests[1:]:
            self.assertLess(rest.mib, (1 + GROWTH) * rests[0].mib)
        if RUN_S >= LONG_ENOUGH_S:
            allowed = GROWTH_PER_HOUR * rests[0].mib + 2 * NOISE_MIB * 3600 / RUN_S
            self.assertLess(growth_mib_per_hour, allowed)
            self.assertGreater(self.deaths, 0)

    def check_counts(self, before, parts, after):
        for name in ("descriptors", "threads"):
            most = [max(getattr(sample, name) for sample in part) for part in parts]
            print(f"{name}: {getattr(before, name)} before, at most {most[0]} in the first part, {most[-1]} in the "
                  f"last, {getattr(after, name)} after", flush=True)
            self.assertLess(most[-1], 1.25 * most[0] + 5)
            self.assertLess(getattr(after, name), getattr(before, name) + 2 * CLIENTS)

    def test_nothing_grows_and_no_place_is_used_up(self):
        self.serve("--scene-grace", "1", "--metrics", f"127.0.0.1:{free_port()}")
        model = self.client.model()
        self.lives = self.deaths = 0
        before = self.sample()
        parts = []
        rests = []
        for _ in range(PARTS):
            parts.append(self.churn(model))
            rests.append(self.rest())
            print(f"{self.lives} lives, {self.deaths} deaths without a word; memory amid the clients "
                  f"{statistics.median(sample.mib for sample in parts[-1]):.1f} MiB, at most "
                  f"{max(sample.mib for sample in parts[-1]):.1f}; at rest {rests[-1].mib:.1f}, of which "
                  f"{rests[-1].file_mib:.2f} are of files, {self.allocated_mib():.2f} allocated", flush=True)
        self.check_counts(before, parts, rests[-1])
        self.check_memory(before, rests)
        self.assertGreater(self.lives, CLIENTS)
