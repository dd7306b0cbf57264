# SPDX-License-Identifier: Apache-2.0
"""The commands that look after stored models, with a running daemon and without."""

import json
import pathlib
import sqlite3
import subprocess
import tempfile
import unittest

import scripted
import strike
from carillon.v1 import admin_service_pb2, admin_service_pb2_grpc
from daemon import BIN, Daemon

import grpc


class DatabaseCommandsTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        (self.folder / "token").write_text("a token for this test\n")
        self.daemon = Daemon(self.folder, "--listen", "127.0.0.1:0", "--admin-token-file",
                             self.folder / "token")
        self.addCleanup(lambda: self.daemon.stop())
        self.model_file = scripted.make_model(self.folder)
        self.name = self.run_command("model", "import", self.model_file, "--label", "bar").strip()

    def run_command(self, *arguments):
        return self.daemon.command(*arguments).stdout

    def stats(self):
        return json.loads(self.run_command("--json", "db", "stats"))

    def offline(self, *arguments):
        """carillond db ... on the folder of the daemon, which is stopped."""
        return subprocess.run([BIN / "carillond", "--data-dir", self.folder / "data", "db",
                               *map(str, arguments)], capture_output=True, text=True, check=False)

    def flip_a_bit(self):
        with sqlite3.connect(self.folder / "data/carillon.db") as database:
            row, data = database.execute("SELECT rowid, data FROM model_chunks").fetchone()
            database.execute("UPDATE model_chunks SET data = ? WHERE rowid = ?",
                             (bytes([data[0] ^ 4]) + data[1:], row))
        database.close()

    def test_an_exported_model_is_the_imported_one_and_keeps_its_name(self):
        digest = self.name.removeprefix("modalModels/")
        out = self.folder / f"{digest}.model"
        self.run_command("model", "export", "bar", "--out", out)
        self.assertEqual(out.read_bytes(), self.model_file.read_bytes())
        self.run_command("model", "delete", "bar")
        self.assertEqual(self.run_command("model", "import", out).strip(), self.name)

    def test_models_are_found_by_tag_and_pinned_ones_outlive_collection(self):
        other = self.folder / "other.model"
        records = scripted.read_records(self.model_file)
        records[0].header.solver = "another"
        other.write_bytes(b"".join(scripted.delimited(record) for record in records))
        self.run_command("model", "import", other, "--label", "other")
        self.run_command("model", "tag", "bar", "--add", "chime", "tuned", "--pin")
        self.assertIn("bar", self.run_command("model", "list", "--tag", "chime"))
        self.assertNotIn("other", self.run_command("model", "list", "--tag", "chime"))
        self.assertIn("other", self.run_command("model", "list", "--label", "THE"))
        self.assertIn("1 models deleted", self.run_command("db", "collect", "--budget-mib", 0))
        self.assertEqual(self.stats()["model_count"], "1")
        self.assertIn("bar", self.run_command("model", "list"))

    def test_a_backup_restores_what_was_there_and_keeps_what_came_later_beside_it(self):
        backup = self.folder / "backup.db"
        self.run_command("db", "backup", backup)
        self.run_command("model", "delete", "bar")
        self.assertIn("DATA_DIRECTORY_IN_USE", self.offline("restore", backup).stderr)
        self.daemon.stop()
        self.assertEqual(self.offline("restore", backup).returncode, 0)
        self.assertTrue((self.folder / "data/carillon.db.replaced").exists())
        self.daemon.start()
        self.assertIn("bar", self.run_command("model", "list"))

    def test_check_finds_a_flipped_bit_and_repair_keeps_the_rest(self):
        self.run_command("model", "tag", "bar", "--add", "whole", "--pin")
        digest = "1" * 64
        copy = self.folder / f"{digest}.model"
        copy.write_bytes(self.model_file.read_bytes())
        self.daemon.stop()
        self.assertEqual(self.offline("check").stdout, "0 faults\n")
        self.flip_a_bit()
        self.daemon.start()
        self.run_command("model", "import", copy, "--label", "copy")
        self.daemon.stop()
        checked = self.offline("check")
        self.assertEqual(checked.returncode, 1)
        self.assertIn("has changed on the disk", checked.stdout)
        repaired = self.offline("repair")
        self.assertEqual((repaired.returncode, self.offline("check").stdout), (0, "0 faults\n"),
                         repaired)
        self.assertTrue((self.folder / "data/carillon.db.damaged").exists())
        self.daemon.start()
        listed = self.run_command("model", "list")
        self.assertIn("copy", listed)
        self.assertNotIn("bar", listed)

    def test_a_damaged_backup_is_refused_and_nothing_is_changed(self):
        backup = self.folder / "backup.db"
        self.run_command("db", "backup", backup)
        content = bytearray(backup.read_bytes())
        content[len(content) // 2] ^= 1
        backup.write_bytes(content)
        self.daemon.stop()
        self.assertIn("DATABASE_CORRUPT", self.offline("restore", backup).stderr)
        self.daemon.start()
        self.assertIn("bar", self.run_command("model", "list"))

    def test_over_tcp_only_the_token_makes_an_administrator(self):
        address = next(line.split()[-1] for line in self.daemon.listening if "127.0.0.1" in line)
        admin = admin_service_pb2_grpc.AdminServiceStub(grpc.insecure_channel(address))
        request = admin_service_pb2.GetDatabaseStatsRequest()
        for metadata in ((), (("authorization", "Bearer another token"),)):
            with self.assertRaises(grpc.RpcError) as refused:
                admin.GetDatabaseStats(request, metadata=metadata)
            self.assertEqual(strike.refusal(refused.exception).info.reason, "ADMINISTRATOR_ONLY")
        shown = (("authorization", "Bearer a token for this test"),)
        self.assertEqual(admin.GetDatabaseStats(request, metadata=shown).model_count, 1)


if __name__ == "__main__":
    unittest.main()
