# SPDX-License-Identifier: Apache-2.0
"""The daemon's log: its levels, which a reload changes, and its fields in systemd's journal."""

import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

from carillon.v1 import audio_service_pb2, scene_service_pb2
from daemon import BIN, Daemon

JOURNAL = "/run/systemd/journal"
# Only a daemon that never logs takes this long.
DEADLINE_S = 30.0


def wait_until(test):
    end_s = time.monotonic() + DEADLINE_S
    while not test():
        if time.monotonic() > end_s:
            raise AssertionError("it did not happen")
        time.sleep(0.02)


class LevelTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.configuration = self.folder / "carillond.toml"

    def serve(self, level):
        self.configuration.write_text(f'log_level = "{level}"\n')
        self.daemon = Daemon(self.folder, "--config", self.configuration)
        self.addCleanup(self.daemon.stop)

    def log(self):
        return (self.folder / "log").read_text()

    def create_scene(self):
        return self.daemon.client().scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name

    def change_gain(self, gain):
        self.daemon.client().audio.UpdateMixer(audio_service_pb2.UpdateMixerRequest(gain=gain))

    def test_a_reload_changes_the_level_in_both_directions(self):
        self.serve("info")
        quiet = self.create_scene()
        self.change_gain(0.5)
        self.assertIn(" info: mixer_changed gain=0.5 muted=false caller=local peer=unix:pid-", self.log())
        self.configuration.write_text('log_level = "debug"\n')
        self.daemon.process.send_signal(signal.SIGHUP)
        wait_until(lambda: "were read again" in self.log())
        self.assertNotIn("need a restart", self.log())
        self.assertIn("were read again; the log level is debug", self.log())
        told = self.create_scene()
        self.assertIn(f" debug: scene_created scene={told} ", self.log())
        self.assertNotIn(f"scene_created scene={quiet} ", self.log())
        self.configuration.write_text('log_level = "loud"\n')
        self.daemon.process.send_signal(signal.SIGHUP)
        wait_until(lambda: "nothing was changed by the reload" in self.log())
        self.assertRegex(self.log(), "INVALID_CONFIGURATION: .*log_level")
        self.change_gain(0.25)
        self.assertIn("mixer_changed gain=0.25", self.log())


def namespaces_permitted():
    try:
        return subprocess.run(["unshare", "--mount", "--map-root-user", "mount", "-t", "tmpfs", "none", "/run"],
                              capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        return False


def within_namespace(folder):
    """Runs in a mount namespace of its own, where this process is the journal. Serves one daemon whose stderr is "the
    journal", and writes each message into a file of the folder, until SIGTERM."""
    subprocess.run(["mount", "-t", "tmpfs", "none", "/run"], check=True)
    os.makedirs(JOURNAL)
    journal = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    journal.bind(f"{JOURNAL}/socket")
    # A file in place of the stream that systemd would give.
    stderr = open(folder / "stderr", "wb")  # pylint: disable=consider-using-with
    status = os.fstat(stderr.fileno())
    environment = dict(os.environ, JOURNAL_STREAM=f"{status.st_dev}:{status.st_ino}")
    process = subprocess.Popen(
        [BIN / "carillond", "--data-dir", folder / "data", "--listen", f"unix:{folder}/socket", "--audio-device",
         "null", "--no-transfers"], stdout=subprocess.PIPE, stderr=stderr, env=environment)
    process.stdout.readline()
    subprocess.run([BIN / "carillon", "--server", f"unix:{folder}/socket", "volume", "--gain", "0.5"], check=True,
                   capture_output=True)
    process.terminate()
    process.wait()
    journal.setblocking(False)
    messages = []
    while True:
        try:
            messages.append(journal.recv(1 << 16))
        except BlockingIOError:
            break
    (folder / "messages").write_bytes(b"\0".join(messages))


class JournalTest(unittest.TestCase):
    @unittest.skipUnless(namespaces_permitted(), "mount namespaces are not permitted here")
    def test_the_journal_gets_levels_and_the_fields_of_events(self):
        with tempfile.TemporaryDirectory(prefix="carillon-") as scratch:
            folder = pathlib.Path(scratch)
            subprocess.run(["unshare", "--mount", "--map-root-user", sys.executable, __file__, "journal", folder],
                           check=True, timeout=DEADLINE_S)
            messages = [dict(line.split("=", 1) for line in message.decode().splitlines())
                        for message in (folder / "messages").read_bytes().split(b"\0")]
            self.assertEqual((folder / "stderr").read_bytes(), b"")
        changed = next(message for message in messages if message.get("CARILLON_EVENT") == "mixer_changed")
        self.assertEqual(changed["PRIORITY"], "6")
        self.assertEqual(changed["SYSLOG_IDENTIFIER"], "carillond")
        self.assertEqual(changed["CARILLON_GAIN"], "0.5")
        self.assertEqual(changed["CARILLON_CALLER"], "local")
        self.assertRegex(changed["CARILLON_PEER"], "^unix:pid-[0-9]+$")
        self.assertTrue(changed["MESSAGE"].startswith("mixer_changed gain=0.5 "), changed)
        started = next(message for message in messages if message["MESSAGE"].startswith("plays on null at "))
        self.assertEqual((started["PRIORITY"], started["SYSLOG_IDENTIFIER"]), ("6", "carillond"))
        self.assertNotIn("CODE_FILE", started)


if __name__ == "__main__":
    if sys.argv[1:2] == ["journal"]:
        within_namespace(pathlib.Path(sys.argv[2]))
    else:
        unittest.main()
