# SPDX-License-Identifier: Apache-2.0
"""The daemon's memory is at its limit while it runs: it ends well when it is asked to."""

import pathlib
import re
import resource
import unittest

import torture
from daemon import Daemon


class LittleMemoryTest(torture.ScratchTest):
    @staticmethod
    def leave_room(daemon, mib):
        """Lets the daemon have so much more address space than it has."""
        status = pathlib.Path("/proc", str(daemon.process.pid), "status").read_text()
        size_kib = int(re.search(r"VmSize:\s+(\d+) kB", status).group(1))
        most = (size_kib << 10) + (mib << 20)
        resource.prlimit(daemon.process.pid, resource.RLIMIT_AS, (most, most))

    def test_a_stop_without_room_for_a_thread_ends_well(self):
        for room_mib in torture.rounds((2,), (1, 2, 4, 8, 20, 64)):
            with self.subTest(room_mib=room_mib):
                daemon = Daemon(self.folder)  # without a client, whose connection would need memory
                self.addCleanup(daemon.kill)
                self.leave_room(daemon, room_mib)
                self.assertEqual(daemon.stop(), 0, (self.folder / "log").read_text())


if __name__ == "__main__":
    unittest.main()
