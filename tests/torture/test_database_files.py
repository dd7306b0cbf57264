# SPDX-License-Identifier: Apache-2.0
"""Somebody else removes, replaces, truncates or overwrites the database's files, or fills the disk: nothing that is
acknowledged is lost without a word."""

import contextlib
import os
import pathlib
import shutil
import sqlite3
import subprocess
import tempfile
import unittest

import grpc

import scripted
import strike
import torture
from carillon.v1 import modal_model_service_pb2
from daemon import Daemon

MODELS = "carillon.v1.ModalModelService"
# Makes a disk of 96 MiB over a folder, in a mount namespace of its own, which lasts as long as this process.
SMALL_DISK = ("unshare", "--user", "--map-root-user", "--mount", "sh", "-euc",
              'mount -t tmpfs -o size=96m tmpfs "$0"; echo; exec cat')


class DatabaseFilesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        cls.addClassCleanup(scratch.cleanup)
        cls.records = scripted.read_records(scripted.make_model(scratch.name))

    def small_disk(self):
        """Makes the data folder a small disk. Returns the words with which a program begins that sees it."""
        keeper = subprocess.Popen([*SMALL_DISK, self.folder / "data"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.addCleanup(keeper.communicate)
        keeper.stdout.readline()
        return ("nsenter", "--target", str(keeper.pid), "--user", "--mount", "--preserve-credentials")

    def serve(self, on_small_disk=False):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        (self.folder / "data").mkdir()
        self.file = self.folder / "data/carillon.db"
        self.log = self.folder / "data/carillon.db-wal"
        self.daemon = Daemon(self.folder, prefix=self.small_disk() if on_small_disk else ())
        self.addCleanup(self.daemon.kill)
        self.client = self.daemon.client()

    def restart_after_a_kill(self, harm=lambda: None):
        self.daemon.kill()
        harm()
        self.daemon.start()
        self.client = self.daemon.client()

    def store(self, number):
        """Imports a model; returns the reason of a refusal."""
        name = f"modalModels/{number:064x}"
        try:
            self.client.models.ImportModalModel(modal_model_service_pb2.ImportModalModelRequest(
                record=record, name=name) for record in self.records)
        except grpc.RpcError as error:
            return strike.refusal(error).info.reason
        return ""

    def other_database(self):
        """Returns the bytes of another database, which is larger."""
        with tempfile.TemporaryDirectory(prefix="carillon-") as scratch:
            file = pathlib.Path(scratch) / "other.db"
            with contextlib.closing(sqlite3.connect(file)) as connection:
                connection.executescript("CREATE TABLE a (b); INSERT INTO a VALUES (zeroblob(9000000));")
            return file.read_bytes()

    def stored_count(self):
        return len(list(self.client.list()))

    def said(self, text):
        return text in (self.folder / "log").read_text()

    def test_nothing_is_acknowledged_after_the_files_were_harmed(self):
        def replace(file):
            shutil.copy(file, f"{file}.copy")
            os.replace(f"{file}.copy", file)

        def overwrite(file, content):
            with open(file, "r+b") as opened:
                opened.write(content)
        other = self.other_database()
        harms = {"removed": lambda: self.file.unlink(), "replaced": lambda: replace(self.file),
                 "truncated": lambda: os.truncate(self.file, 0), "log removed": lambda: self.log.unlink(),
                 "log truncated": lambda: os.truncate(self.log, 0),
                 "another copied over it": lambda: overwrite(self.file, other),
                 "beginning overwritten": lambda: overwrite(self.file, bytes(1024)),
                 "log overwritten": lambda: overwrite(self.log, bytes(self.log.stat().st_size))}
        for name, harm in harms.items():
            for _ in range(torture.rounds(1, 20)):
                self.serve()
                self.assertEqual([self.store(number) for number in range(3)], ["", "", ""])
                torture.wait_until(lambda: self.daemon.health(MODELS) == "SERVING", 30)
                harm()
                refused = {self.store(number) for number in range(3, 13)}
                self.assertEqual(refused, {"DATABASE_LOST"}, name)
                torture.wait_until(lambda: self.daemon.health(MODELS) == "NOT_SERVING", 30)
                self.assertEqual(self.daemon.health(), "SERVING")
                self.assertTrue(self.said("DATABASE_LOST: "))
                self.daemon.kill()
            print(f"{name}: 10 of 10 refused, health NOT_SERVING", flush=True)

    def test_a_log_that_is_removed_after_a_kill_is_said_at_the_start(self):
        self.serve()
        self.assertEqual({self.store(number) for number in range(20)}, {""})
        self.restart_after_a_kill()
        self.assertEqual(self.stored_count(), 20)
        self.assertFalse(self.said("are missing"))
        count = 20
        written = self.file.stat().st_mtime_ns
        # The daemon copies the log into the file after some changes. The last change must be in the log only.
        while count < 40 or self.file.stat().st_mtime_ns != written:
            written = self.file.stat().st_mtime_ns
            self.assertEqual(self.store(count), "")
            count += 1
        self.restart_after_a_kill(self.log.unlink)
        lost_count = count - self.stored_count()
        print(f"{lost_count} of {count} models are lost, and the daemon says so", flush=True)
        self.assertGreater(lost_count, 0)
        self.assertTrue(self.said("changes that were acknowledged are missing"))
        self.assertEqual(self.store(500), "")

    def fill_the_disk(self):
        """Stores models, then smaller and smaller meshes, until there is no room for the smallest."""
        count = 0
        while not self.store(count):
            count += 1
        for size in (1 << 20, 1 << 16, 1 << 12, 1):
            with contextlib.suppress(grpc.RpcError):
                while True:
                    self.client.upload(os.urandom(size))
        return count

    def test_models_can_be_deleted_from_a_full_disk_and_it_takes_new_ones_again(self):
        self.serve(on_small_disk=True)
        count = self.fill_the_disk()
        self.assertEqual(self.store(count), "DATABASE_FULL")
        torture.wait_until(lambda: self.daemon.health(MODELS) == "NOT_SERVING", 30)
        self.assertTrue(self.said("DATABASE_FULL: "))
        self.assertEqual(self.daemon.health(), "SERVING")
        self.restart_after_a_kill()
        self.assertEqual(self.store(count), "DATABASE_FULL")
        for number in range(count):
            self.client.models.DeleteModalModel(
                modal_model_service_pb2.DeleteModalModelRequest(name=f"modalModels/{number:064x}"))
        self.assertEqual(self.stored_count(), 0)
        self.assertEqual(self.store(0), "")
        torture.wait_until(lambda: self.daemon.health(MODELS) == "SERVING", 30)
        print(f"{count} of {count} models were deleted from a full disk", flush=True)


if __name__ == "__main__":
    unittest.main()
