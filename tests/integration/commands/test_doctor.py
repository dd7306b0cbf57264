# SPDX-License-Identifier: Apache-2.0
"""`carillon doctor` where a part of the daemon does not serve, or nothing is heard."""

import json
import pathlib
import re
import shutil
import tempfile
import time
import unittest

import carillon
from daemon import ROOT, Daemon


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

    def test_it_finds_why_nothing_is_heard_and_says_what_the_page_says(self):
        self.assertEqual(self.findings("NOTE"), {})
        self.daemon.command("volume", "--mute")
        with carillon.connect(self.daemon.server) as c, c.scene() as heard, c.scene() as other:
            heard.update(solo=True)
            told = json.loads(self.daemon.command("doctor", "--json").stdout)["findings"]
        notes = {found["id"]: found for found in told if found["verdict"] == "NOTE"}
        self.assertEqual({name: found["subject"] for name, found in notes.items()},
                         {"OUTPUT_MUTED": "sound", "SCENE_MUTED": other.name})
        page = (ROOT / "docs/troubleshoot.md").read_text()
        for name, found in notes.items():
            meaning, repair = re.search(rf"(?m)^\| {name} \| (.*) \| (.*) \|$", page).groups()
            self.assertTrue(found["text"].endswith(f": {meaning}; {repair}"), found["text"])
            explained = json.loads(self.daemon.command("--json", "explain", name).stdout)
            self.assertEqual((explained["meaning"], explained["repair"]), (meaning, repair))

    def test_it_finds_a_database_that_was_moved_away(self):
        (self.folder / "data/carillon.db").rename(self.folder / "data/away.db")
        self.wait_until_not_serving(self.MODELS)
        self.assertEqual(set(self.findings()), {self.MODELS, self.DECOMPOSITIONS})


if __name__ == "__main__":
    unittest.main()
