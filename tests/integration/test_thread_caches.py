# SPDX-License-Identifier: Apache-2.0
"""The daemon turns the thread caches of glibc's allocator off, which hold back freed memory."""

import os
import pathlib
import re
import subprocess
import tempfile
import unittest

from daemon import BIN, Daemon


class ThreadCachesTest(unittest.TestCase):
    def tunables(self, given, *arguments, prefix=()):
        """The tunables of a daemon that was started with those given, or with none."""
        environment = {name: value for name, value in os.environ.items() if name != "GLIBC_TUNABLES"}
        with tempfile.TemporaryDirectory(prefix="carillon-") as folder:
            daemon = Daemon(folder, *arguments, environment=environment | given, prefix=prefix)
            try:
                process = pathlib.Path("/proc", str(daemon.process.pid))
                program = pathlib.Path(*prefix[:1] or ["carillond"])
                self.assertEqual((process / "comm").read_text().strip(), program.name[:15])
                # glibc puts zeros in place of the colons between the tunables.
                variables = (process / "environ").read_text().split("\0")
                self.assertEqual(daemon.stop(), 0)
            finally:
                daemon.kill()
        return [one.removeprefix("GLIBC_TUNABLES=") for one in variables
                if one.startswith(("GLIBC_TUNABLES=", "glibc."))]

    def test_they_are_off(self):
        self.assertEqual(self.tunables({}), ["glibc.malloc.tcache_count=0"])

    def test_a_daemon_that_the_loader_was_told_to_start_starts(self):
        (loader,) = re.findall(r"\[Requesting program interpreter: (.*)\]", subprocess.run(
            ["readelf", "--program-headers", BIN / "carillond"], check=True, capture_output=True, text=True).stdout)
        self.assertEqual(self.tunables({}, "--precompute", BIN / "carillon-precompute", prefix=[loader]), [])

    def test_other_tunables_are_kept(self):
        self.assertEqual(self.tunables({"GLIBC_TUNABLES": "glibc.malloc.perturb=0"}),
                         ["glibc.malloc.perturb=0", "glibc.malloc.tcache_count=0"])

    def test_the_size_of_the_caches_that_an_operator_wants_is_kept(self):
        self.assertEqual(self.tunables({"GLIBC_TUNABLES": "glibc.malloc.tcache_count=3"}),
                         ["glibc.malloc.tcache_count=3"])


if __name__ == "__main__":
    unittest.main()
