# SPDX-License-Identifier: Apache-2.0
"""The daemon's log: its levels, which a reload changes, and its fields in systemd's journal."""

import os
import pathlib
import signal
import socket
import subprocess
import sys
import unittest

import carillon
from daemon import Daemon, ScratchTest, wait_until

JOURNAL = "/run/systemd/journal"


class LevelTest(ScratchTest):
    def reload(self, level, told):
        (self.folder / "carillond.toml").write_text(f'log_level = "{level}"\n')
        self.daemon.process.send_signal(signal.SIGHUP)
        wait_until(lambda: told in self.daemon.log())

    def test_a_reload_changes_the_level_in_both_directions(self):
        configuration = self.folder / "carillond.toml"
        configuration.write_text('log_level = "info"\n')
        self.serve("--config", configuration)
        c = self.enterContext(carillon.connect(self.daemon.server))
        quiet = c.scene().name
        c.set_volume(gain=0.5)
        self.assertIn(" info: mixer_changed gain=0.5 muted=false caller=local peer=unix:pid-", self.daemon.log())
        self.reload("debug", "were read again; the log level is debug")
        self.assertNotIn("need a restart", self.daemon.log())
        told = c.scene().name
        self.assertIn(f" debug: scene_created scene={told} ", self.daemon.log())
        self.assertNotIn(f"scene_created scene={quiet} ", self.daemon.log())
        self.reload("loud", "nothing was changed by the reload")
        self.assertRegex(self.daemon.log(), "INVALID_CONFIGURATION: .*log_level")
        c.set_volume(gain=0.25)
        self.assertIn("mixer_changed gain=0.25", self.daemon.log())


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
    # The log, a file, stands for the stream that systemd would give.
    (folder / "log").touch()
    status = (folder / "log").stat()
    daemon = Daemon(folder, environment=dict(os.environ, JOURNAL_STREAM=f"{status.st_dev}:{status.st_ino}"))
    daemon.command("volume", "--gain", "0.5")
    daemon.stop()
    journal.setblocking(False)
    messages = []
    while True:
        try:
            messages.append(journal.recv(1 << 16))
        except BlockingIOError:
            break
    (folder / "messages").write_bytes(b"\0".join(messages))


class JournalTest(ScratchTest):
    @unittest.skipUnless(namespaces_permitted(), "mount namespaces are not permitted here")
    def test_the_journal_gets_levels_and_the_fields_of_events(self):
        subprocess.run(["unshare", "--mount", "--map-root-user", sys.executable, __file__, self.folder], check=True,
                       timeout=30)
        messages = [dict(line.split("=", 1) for line in message.decode().splitlines())
                    for message in (self.folder / "messages").read_bytes().split(b"\0")]
        self.assertEqual((self.folder / "log").read_bytes(), b"")
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
    within_namespace(pathlib.Path(sys.argv[1]))
