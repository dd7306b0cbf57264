# SPDX-License-Identifier: Apache-2.0
"""`carillon doctor` where a part of the daemon does not serve."""

import json
import pathlib
import shutil
import tempfile
import time
import unittest

from daemon import Daemon


class HealthTest(unittest.TestCase):
    MODELS = "carillon.v1.ModalModelService"
    DECOMPOSITIONS = "carillon.v1.DecompositionService"

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="carillon-")))
        self.precompute = self.folder / "precompute"
        shutil.copy("/bin/true", self.precompute)
        self.daemon = Daemon(self.folder, "--precompute", self.precompute)
        self.addCleanup(self.daemon.stop)

    def wait_until_not_serving(self, service):
        end_s = time.monotonic() + 30
        while self.daemon.health(service) != "NOT_SERVING":
            self.assertLess(time.monotonic(), end_s, service)
            time.sleep(0.05)

    def findings(self, verdict="FAULT"):
        """The texts of the doctor's findings with this verdict, by their subject."""
        told = json.loads(self.daemon.command("doctor", "--json", check=False).stdout)
        return {found["subject"]: found["text"] for found in told["findings"] if found["verdict"] == verdict}

    def test_it_finds_a_program_of_decompositions_that_is_gone(self):
        self.precompute.unlink()
        self.wait_until_not_serving(self.DECOMPOSITIONS)
        found = self.daemon.command("doctor", check=False)
        self.assertEqual(found.returncode, 1)
        self.assertRegex(found.stdout, rf"(?m)^FAULT +{self.DECOMPOSITIONS} +is NOT_SERVING: .*carillon-precompute")
        self.assertRegex(found.stdout, rf"(?m)^OK +{self.MODELS} +is SERVING$")
        self.assertRegex(found.stderr, "^carillon: NOT_SERVING: ")

    def test_it_finds_a_folder_of_decompositions_that_cannot_be_used(self):
        work = self.folder / "data/work"
        work.rmdir()
        work.write_text("not a folder")
        self.wait_until_not_serving(self.DECOMPOSITIONS)
        self.assertRegex(self.findings()[self.DECOMPOSITIONS], "^is NOT_SERVING: .*folder work")
        self.assertRegex((self.folder / "log").read_text(), "decompositions_impossible error=.WORK_FOLDER_UNUSABLE: "
                         f"{work}, .*remove the file in place of the folder")
        work.unlink()
        end_s = time.monotonic() + 30
        while self.daemon.health(self.DECOMPOSITIONS) != "SERVING":
            self.assertLess(time.monotonic(), end_s)
            time.sleep(0.05)

    def test_it_finds_a_database_that_was_moved_away(self):
        (self.folder / "data/carillon.db").rename(self.folder / "data/away.db")
        self.wait_until_not_serving(self.MODELS)
        self.assertEqual(set(self.findings()), {self.MODELS, self.DECOMPOSITIONS})


if __name__ == "__main__":
    unittest.main()
