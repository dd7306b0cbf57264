# SPDX-License-Identifier: Apache-2.0
"""Somebody else removes, replaces or truncates the database's file, or fills the disk: nothing is acknowledged after
that."""

import contextlib
import os
import pathlib
import shutil
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
        self.daemon = Daemon(self.folder, prefix=self.small_disk() if on_small_disk else ())
        self.addCleanup(self.daemon.kill)
        self.client = self.daemon.client()

    def restart_after_a_kill(self):
        self.daemon.kill()
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

    def stored_count(self):
        return len(list(self.client.list()))

    def said(self, text):
        return text in (self.folder / "log").read_text()

    def test_nothing_is_acknowledged_after_the_file_was_harmed(self):
        def replace(file):
            shutil.copy(file, f"{file}.copy")
            os.replace(f"{file}.copy", file)
        harms = {"removed": lambda: self.file.unlink(), "replaced": lambda: replace(self.file),
                 "truncated": lambda: os.truncate(self.file, 0)}
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
