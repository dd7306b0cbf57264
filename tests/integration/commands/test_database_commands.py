# SPDX-License-Identifier: Apache-2.0
"""The commands that look after stored models, with a running daemon and without."""

import lzma
import os
import pathlib
import resource
import signal
import sqlite3
import subprocess
import tempfile

import numpy

import carillon
import scripted
from daemon import BIN, ROOT, ScratchTest


def allow_small_files_only():
    """As on a full disk: a write beyond 8 KiB fails, and does not end the program."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192))


class DatabaseCommandsTest(ScratchTest):
    @classmethod
    def setUpClass(cls):
        cls.model_file = scripted.make_model(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="carillon-")))

    def setUp(self):
        super().setUp()
        self.serve()
        self.name = self.run_command("model", "import", self.model_file, "--label", "bar").strip()

    def run_command(self, *arguments):
        return self.daemon.command(*arguments).stdout

    def offline(self, *arguments, before=None):
        """carillond db ... on the folder of the daemon, which is stopped. Calls `before` first."""
        return subprocess.run([BIN / "carillond", "--data-dir", self.folder / "data", "db", *map(str, arguments)],
                              capture_output=True, text=True, check=False, preexec_fn=before)

    def back_up(self):
        self.run_command("db", "backup", self.folder / "backup.db")
        return self.folder / "backup.db"

    def assert_bar_is_there(self):
        self.assertIn("bar", self.run_command("model", "list"))

    def flip_a_bit(self, file="data/carillon.db"):
        with sqlite3.connect(self.folder / file) as database:
            row, data = database.execute("SELECT rowid, data FROM model_chunks").fetchone()
            database.execute("UPDATE model_chunks SET data = ? WHERE rowid = ?", (bytes([data[0] ^ 4]) + data[1:], row))
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
        self.assertIn("1 model deleted", self.run_command("db", "collect", "--delete-unpinned"))
        self.assertEqual(self.daemon.json("db", "stats")["model_count"], 1)
        self.assert_bar_is_there()

    def import_copies(self, count):
        """Further models that differ in their names alone."""
        for i in range(count):
            copy = self.folder / f"{i:064x}.model"
            copy.write_bytes(self.model_file.read_bytes())
            self.run_command("model", "import", copy, "--label", f"copy {i}")

    def listed(self, *options):
        """The labels that the command lists, and the token of the next page."""
        answer = self.daemon.json("model", "list", *options)
        return [model["label"] for model in answer["modal_models"]], answer["next_page_token"]

    def test_models_are_listed_page_by_page(self):
        self.import_copies(4)
        everything, token = self.listed()
        self.assertEqual((everything, token), (["copy 3", "copy 2", "copy 1", "copy 0", "bar"], ""))
        first, token = self.listed("--page-size", 3)
        second, end = self.listed("--page-size", 3, "--page-token", token)
        self.assertEqual((first + second, end), (everything, ""))
        printed = self.run_command("model", "list", "--page-size", 3).splitlines()
        self.assertEqual((len(printed), printed[3]), (4, f"more with --page-token {token}"))
        self.assertEqual([model.label for model in self.daemon.client().list(page_size=2)], everything)

    def test_a_backup_restores_what_was_there_and_keeps_what_came_later_beside_it(self):
        backup = self.back_up()
        self.run_command("model", "delete", "bar")
        self.assertIn("DATABASE_BUSY", self.offline("restore", backup).stderr)
        self.daemon.stop()
        self.assertEqual(self.offline("restore", backup).returncode, 0)
        self.assertTrue((self.folder / "data/carillon.db.replaced").exists())
        self.daemon.start()
        self.assert_bar_is_there()

    def test_a_backup_replaces_a_file_only_once_it_is_complete(self):
        backup = self.folder / "backup.db"
        link = self.folder / "link.db"
        link.symlink_to(backup.name)
        for target in (backup, link):
            backup.write_bytes(b"an older copy")
            backup.chmod(0o644)
            self.run_command("db", "backup", target)
            self.assertEqual(backup.read_bytes()[:16], b"SQLite format 3\0")
            self.assertEqual(backup.stat().st_mode & 0o777, 0o600)
            self.assertTrue(link.is_symlink())
        before = backup.read_bytes()
        files = sorted(self.folder.iterdir())
        # Nothing is left of a copy that does not fit.
        cut = self.daemon.command("db", "backup", backup, check=False, preexec_fn=allow_small_files_only)
        self.assertEqual(cut.returncode, 1)
        self.assertIn("OUTPUT_NOT_WRITABLE: ", cut.stderr)
        nobody = self.daemon.command("db", "backup", backup, server=f"unix:{self.folder}/nobody", check=False)
        self.assertEqual(nobody.returncode, 3)
        self.assertEqual(backup.read_bytes(), before)
        self.assertEqual(sorted(self.folder.iterdir()), files)

    def test_a_backup_goes_into_pipes_and_names_what_it_cannot_write(self):
        piped = self.daemon.command("db", "backup", "/dev/stdout", text=False)
        self.assertEqual(piped.stdout[:16], b"SQLite format 3\0")
        for target, why in ((self.folder / "data/carillon.db", "belongs to the database of a daemon"),
                            (self.folder, "it is a folder"), ("/dev/full", "No space left on device"),
                            (self.folder / "none/backup.db", f"the folder {self.folder}/none does not exist")):
            with self.subTest(target=target):
                refused = self.daemon.command("db", "backup", target, check=False)
                self.assertEqual(refused.returncode, 1)
                self.assertRegex(refused.stderr, f"OUTPUT_NOT_WRITABLE: {target} .*{why}")

    def test_check_finds_a_flipped_bit(self):
        self.daemon.stop()
        self.assertEqual(self.offline("check").stdout.splitlines(), ["models: 1, meshes: 0, jobs: 0", "0 faults"])
        self.flip_a_bit()
        checked = self.offline("check")
        self.assertEqual(checked.returncode, 1)
        self.assertRegex(checked.stdout, self.name + " has changed on the disk .*\nmodels: 1, .*\n1 fault\n")
        self.assertIn("DATABASE_CORRUPT: ", checked.stderr)
        self.daemon.start()

    def test_what_sqlite_can_read_is_recovered(self):
        """By the commands of docs/troubleshoot.md for a damaged file without a backup."""
        self.import_copies(20)
        self.daemon.stop()
        data = self.folder / "data"
        file = data / "carillon.db"
        os.truncate(file, file.stat().st_size * 3 // 4)
        self.assertEqual(self.offline("check").returncode, 1)
        page = (ROOT / "docs/troubleshoot.md").read_text()
        repair = page[page.index("### Repair"):]
        commands = [line.strip() for line in repair[:repair.index("    carillond")].splitlines() if line[:4] == "    "]
        self.assertEqual(commands.pop(0), "cd /var/lib/carillon")
        subprocess.run(["sh", "-c", "\n".join(commands)], cwd=data, check=False, stderr=subprocess.DEVNULL)
        checked = self.offline("check")
        self.assertNotIn("structure: ", checked.stdout)
        self.daemon.start()
        whole_count = 0
        for number in range(20):
            exported = self.daemon.command("model", "export", f"copy {number}", "--out", self.folder / "out.model",
                                           check=False)
            whole_count += exported.returncode == 0
        print(f"{whole_count} of 20 models are recovered from three quarters of the file", flush=True)
        self.assertGreater(whole_count, 5)

    def test_a_damaged_backup_is_refused_and_nothing_is_changed(self):
        backup = self.back_up()
        # This byte belongs to what is stored. A change of a page's unused bytes would be no damage.
        self.flip_a_bit("backup.db")
        self.daemon.stop()
        self.assertIn("DATABASE_CORRUPT", self.offline("restore", backup).stderr)
        self.daemon.start()
        self.assert_bar_is_there()

    def test_a_restore_without_space_leaves_all_as_it_is(self):
        backup = self.back_up()
        self.daemon.stop()
        data = self.folder / "data"
        names = sorted(path.name for path in data.iterdir())
        limit = (data / "carillon.db").stat().st_size // 2
        failed = self.offline("restore", backup,
                              before=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        self.assertEqual((failed.returncode, failed.stdout), (1, ""))
        self.assertRegex(failed.stderr, "DATABASE_(FULL|IO_ERROR|UNUSABLE): ")
        self.assertEqual(self.offline("check").stdout.splitlines(), ["models: 1, meshes: 0, jobs: 0", "0 faults"])
        self.assertEqual(sorted(path.name for path in data.iterdir()), names)


class UpgradeTest(ScratchTest):
    """schema_1.db.xz was written by the programs of the first schema: it has a model of a bar, and a job that had not
    ended when its daemon was killed."""

    def setUp(self):
        super().setUp()
        self.old = self.folder / "old.db"
        self.old.write_bytes(lzma.decompress(pathlib.Path(__file__).with_name("schema_1.db.xz").read_bytes()))
        with sqlite3.connect(self.old) as database:
            self.assertEqual(database.execute("PRAGMA user_version").fetchone(), (1,))
            (row,), = database.execute("SELECT data FROM model_chunks WHERE array = 0").fetchall()
        database.close()
        self.eigenvalues = numpy.frombuffer(row)

    def assert_serves(self):
        self.serve()
        with carillon.connect(self.daemon.server) as c:
            bar, waited = c.model("bar of schema 1"), next(iter(c.jobs(label_contains="waiting bar"))).wait()
            bronze = c.materials["bell_bronze"]
            expected = numpy.sqrt(self.eigenvalues * bronze.young_pa / bronze.density_kg_per_m3) / (2 * numpy.pi)
            numpy.testing.assert_allclose(bar.frequencies("bell_bronze"), expected, rtol=1e-3)
            sound = bar.render_strike((0.1, 0.015, 0.008), (0, 0, -0.01), material="bell_bronze")
            self.assertLess(abs(sound.loudest_frequency_hz() - expected).min(), 2)
            self.assertEqual(waited.mode_count, 2)
        self.assertEqual(self.daemon.json("db", "stats")["model_count"], 2)
        self.assertEqual(self.daemon.stop(), 0)
        checked = subprocess.run([BIN / "carillond", "--data-dir", self.folder / "data", "db", "check"],
                                 capture_output=True, text=True, check=True)
        self.assertIn("0 faults", checked.stdout)

    def test_a_database_of_the_first_schema_sounds_and_its_job_ends(self):
        (self.folder / "data").mkdir()
        self.old.rename(self.folder / "data/carillon.db")
        self.assert_serves()

    def test_a_backup_of_the_first_schema_is_restored(self):
        subprocess.run([BIN / "carillond", "--data-dir", self.folder / "data", "db", "restore", self.old], check=True,
                       stdout=subprocess.DEVNULL)
        self.assert_serves()
