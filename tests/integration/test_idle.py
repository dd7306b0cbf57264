# SPDX-License-Identifier: Apache-2.0
"""A daemon on the null device that nobody uses hardly wakes, and its frames go on with time."""

import pathlib
import time

from carillon.v1 import modal_model_service_pb2
from daemon import DaemonTest, resident_mib, wait_until

# With a thread that renders each block the daemon woke 1,430 times a second.
MOST_WAKE_UPS_PER_S = 450
WINDOW_S = 2
RATE_HZ = 48000


class IdleTest(DaemonTest):
    def wake_ups(self):
        """Returns how often the threads have waited so far."""
        tasks = pathlib.Path(f"/proc/{self.daemon.process.pid}/task")
        return sum(int(line.split()[1]) for status in tasks.glob("*/status")
                   for line in status.read_text().splitlines() if line.startswith("voluntary_ctxt_switches"))

    def wake_ups_per_s(self):
        before = self.wake_ups()
        time.sleep(WINDOW_S)
        return (self.wake_ups() - before) / WINDOW_S

    def frame(self):
        return self.daemon.json("status")["frame_count"]

    def test_it_sleeps_while_its_frames_go_on(self):
        deadline = time.monotonic() + 30
        rates = []
        while not rates or rates[-1] > MOST_WAKE_UPS_PER_S and time.monotonic() < deadline:
            rates.append(self.wake_ups_per_s())
        print(f"{rates[-1]:.0f} wake-ups a second", flush=True)
        self.assertLess(rates[-1], MOST_WAKE_UPS_PER_S, rates)
        begin, first = time.monotonic(), self.frame()
        time.sleep(WINDOW_S)
        last, end = self.frame(), time.monotonic()
        # A pause renders ten times a second.
        self.assertAlmostEqual((last - first) / RATE_HZ, end - begin, delta=0.5)

    def test_the_memory_of_large_messages_is_given_back(self):
        before = resident_mib(self.daemon.process)
        piece = modal_model_service_pb2.UploadMeshRequest(data=bytes(2**20))
        self.client.models.UploadMesh(iter([piece] * 64))
        back_s = wait_until(lambda: resident_mib(self.daemon.process) < before + 16)
        print(f"{before:.0f} MiB before 64 MiB came, given back after {back_s:.1f} s", flush=True)
