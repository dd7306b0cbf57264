# SPDX-License-Identifier: Apache-2.0
"""`carillon doctor` where something else than a daemon sits at the socket."""

import contextlib
import socket
import subprocess
import tempfile
import time
import unittest

from daemon import BIN


class DoctorTest(unittest.TestCase):
    def test_the_doctor_does_not_wait_long_for_a_process_that_says_nothing(self):
        folder = self.enterContext(tempfile.TemporaryDirectory(prefix="carillon-"))
        for name, backlog, waiting_count in (("mute", 8, 0), ("full", 0, 1)):
            path = f"{folder}/{name}"
            with self.subTest(name=name), contextlib.ExitStack() as stack:
                mute = stack.enter_context(socket.socket(socket.AF_UNIX))
                mute.bind(path)
                mute.listen(backlog)
                for _ in range(waiting_count):  # its queue is then full
                    stack.enter_context(socket.socket(socket.AF_UNIX)).connect(path)
                begin_s = time.monotonic()
                told = subprocess.run([BIN / "carillon", "--server", f"unix:{path}", "doctor"],
                                      capture_output=True, text=True, check=False, timeout=60)
                self.assertLess(time.monotonic() - begin_s, 12)  # a call would wait for 20 s
                self.assertEqual(told.returncode, 1)
                self.assertRegex(told.stdout, f"FAULT  daemon .*the process at {path} has sent nothing for 5 s: "
                                              ".*start carillond again")


if __name__ == "__main__":
    unittest.main()
