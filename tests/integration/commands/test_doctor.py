# SPDX-License-Identifier: Apache-2.0
"""`carillon doctor` where a part of the daemon does not serve, or nothing is heard."""

import json
import re
import shutil

import carillon
from daemon import ROOT, ScratchTest, wait_until


class HealthTest(ScratchTest):
    MODELS = "carillon.v1.ModalModelService"
    DECOMPOSITIONS = "carillon.v1.DecompositionService"

    def setUp(self):
        super().setUp()
        self.precompute = self.folder / "precompute"
        shutil.copy("/bin/true", self.precompute)
        self.serve("--precompute", self.precompute)

    def wait_until_it_is(self, health, service):
        wait_until(lambda: self.daemon.health(service) == health)

    def findings(self, verdict="FAULT"):
        """The texts of the doctor's findings with this verdict, by their subject."""
        told = json.loads(self.daemon.command("doctor", "--json", check=False).stdout)
        return {found["subject"]: found["text"] for found in told["findings"] if found["verdict"] == verdict}

    def test_it_finds_a_program_of_decompositions_that_is_gone(self):
        self.precompute.unlink()
        self.wait_until_it_is("NOT_SERVING", self.DECOMPOSITIONS)
        found = self.daemon.command("doctor", check=False)
        self.assertEqual(found.returncode, 1)
        self.assertRegex(found.stdout, rf"(?m)^FAULT +{self.DECOMPOSITIONS} +is NOT_SERVING: .*carillon-precompute")
        self.assertRegex(found.stdout, rf"(?m)^OK +{self.MODELS} +is SERVING$")
        self.assertRegex(found.stderr, "^carillon: NOT_SERVING: ")

    def test_it_finds_a_folder_of_decompositions_that_cannot_be_used(self):
        work = self.folder / "data/work"
        work.rmdir()
        work.write_text("not a folder")
        self.wait_until_it_is("NOT_SERVING", self.DECOMPOSITIONS)
        self.assertRegex(self.findings()[self.DECOMPOSITIONS], "^is NOT_SERVING: .*folder work")
        self.assertRegex(self.daemon.log(), "decompositions_impossible error=.WORK_FOLDER_UNUSABLE: "
                         f"{work}, .*remove the file in place of the folder")
        work.unlink()
        self.wait_until_it_is("SERVING", self.DECOMPOSITIONS)

    def test_it_finds_why_nothing_is_heard_and_says_what_the_page_says(self):
        self.assertEqual(self.findings("NOTE"), {})
        self.daemon.command("volume", "--mute")
        with carillon.connect(self.daemon.server) as c, c.scene() as heard, c.scene() as other:
            heard.update(solo=True)
            told = self.daemon.json("doctor")["findings"]
        notes = {found["id"]: found for found in told if found["verdict"] == "NOTE"}
        self.assertEqual({name: found["subject"] for name, found in notes.items()},
                         {"OUTPUT_MUTED": "sound", "SCENE_MUTED": other.name})
        page = (ROOT / "docs/troubleshoot.md").read_text()
        for name, found in notes.items():
            meaning, repair = re.search(rf"(?m)^\| {name} \| (.*) \| (.*) \|$", page).groups()
            self.assertTrue(found["text"].endswith(f": {meaning}; {repair}"), found["text"])
            explained = self.daemon.json("explain", name)
            self.assertEqual((explained["meaning"], explained["repair"]), (meaning, repair))

    def test_it_finds_a_database_that_was_moved_away(self):
        (self.folder / "data/carillon.db").rename(self.folder / "data/away.db")
        self.wait_until_it_is("NOT_SERVING", self.MODELS)
        self.assertEqual(set(self.findings()), {self.MODELS, self.DECOMPOSITIONS})
