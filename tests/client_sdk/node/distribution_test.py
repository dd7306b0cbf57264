# SPDX-License-Identifier: Apache-2.0
"""The package for Node as it is distributed: an archive that works alone, and types that TypeScript believes."""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
MODULES = pathlib.Path(os.environ["CARILLON_NODE_MODULES"])
VERSION = re.search(r"project\(carillon VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]


def run(*words, **options):
    done = subprocess.run([str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          check=False, **options)
    return done.returncode, done.stdout


class DistributionTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        cls.addClassCleanup(scratch.cleanup)
        cls.folder = pathlib.Path(scratch.name)
        code, said = run(sys.executable, ROOT / "client_sdk/node/pack.py", MODULES, cls.folder)
        if code:
            raise AssertionError(said)
        # As npm would install it: the archive unpacked, beside what it depends on.
        cls.modules = cls.folder / "node_modules"
        cls.modules.mkdir()
        with tarfile.open(cls.folder / f"carillon-{VERSION}.tgz") as tar:
            tar.extractall(cls.folder / "unpacked")
        (cls.folder / "unpacked/package").rename(cls.modules / "carillon")
        for module in MODULES.iterdir():
            (cls.modules / module.name).symlink_to(module)

    def assert_prints(self, expected, *words):
        code, said = run(*words, cwd=self.folder)
        self.assertEqual((code, said.strip()), (0, expected))

    def test_it_has_the_version_of_the_project_and_needs_what_its_lock_names(self):
        lock = json.loads((ROOT / "client_sdk/node/package-lock.json").read_text())["packages"]
        package = json.loads((self.modules / "carillon/package.json").read_text())
        self.assertEqual((package["version"], lock[""]["version"]), (VERSION, VERSION))
        for name in package["dependencies"]:
            self.assertIn(f"node_modules/{name}", lock)

    def test_it_loads_by_require_and_by_import(self):
        code = "connect('unix:/nowhere').status().catch((error) => console.log(error.reason))"
        self.assert_prints("SERVER_UNAVAILABLE", "node", "-e", f"const {{ connect }} = require('carillon'); {code}")
        self.assert_prints("SERVER_UNAVAILABLE", "node", "--input-type=module", "-e",
                           f"import {{ connect }} from 'carillon'; {code}")

    def test_it_has_the_adapters_of_engines(self):
        adapters = sorted(path.stem for path in (ROOT / "client_sdk/adapters").glob("*_contacts.js"))
        self.assertIn("rapier_contacts", adapters)
        for adapter in adapters:
            self.assert_prints("function", "node", "-p",
                               f"typeof Object.values(require('carillon/adapters/{adapter}'))[0]")

    def test_a_package_that_cannot_be_made_is_refused_in_a_sentence(self):
        pack = ROOT / "client_sdk/node/pack.py"
        for expected, *arguments in (("Usage: pack.py NODE_MODULES FOLDER",),
                                     ("does not have what package-lock.json names; run", "/nowhere", self.folder / "x"),
                                     ("carillon is there already", MODULES, self.folder),
                                     ("/dev/null", MODULES, "/dev/null")):
            code, said = run(sys.executable, pack, *arguments)
            self.assertEqual(code, 1)
            self.assertIn(expected, said)
            self.assertNotIn("Traceback", said)

    def test_a_package_that_fails_half_way_leaves_nothing(self):
        tree, folder = self.folder / "tree", self.folder / "half"
        (tree / "client_sdk").mkdir(parents=True)
        shutil.copytree(ROOT / "proto", tree / "proto")
        shutil.copytree(ROOT / "client_sdk/node", tree / "client_sdk/node",
                        ignore=shutil.ignore_patterns("node_modules"))
        command = [sys.executable, tree / "client_sdk/node/pack.py", MODULES, folder]
        code, said = run(*command)  # without the licence
        self.assertEqual((code, list(folder.iterdir())), (1, []), said)
        shutil.copy(ROOT / "LICENSE", tree)
        code, said = run(*command)
        self.assertEqual(code, 0, said)
        self.assertEqual(sorted(item.name for item in folder.iterdir()), ["carillon", f"carillon-{VERSION}.tgz"])

    def test_npm_packs_the_package_and_refuses_its_source(self):
        code, said = run("npm", "pack", "--dry-run", cwd=ROOT / "client_sdk/node")
        self.assertNotEqual(code, 0)
        self.assertIn("Make the package by: npm ci, then ./pack.py node_modules FOLDER", said)
        code, said = run("npm", "pack", "--dry-run", cwd=self.modules / "carillon")
        self.assertEqual(code, 0, said)

    def test_it_tells_its_callers_what_is_wrong(self):
        code, said = run("node", "--test", pathlib.Path(__file__).with_name("messages.test.js"), cwd=self.folder,
                         env={**os.environ, "NODE_PATH": str(self.modules)})
        self.assertEqual(code, 0, said)
        self.assertNotIn("# pass 0", said.replace("ℹ", "#"))

    def test_types_accept_a_program_that_is_right_and_refuse_those_that_are_wrong(self):
        (self.folder / "right.ts").write_text(pathlib.Path(__file__).with_name("usage.ts").read_text())
        wrong = ("c.createModel('a.obj', {})", "c.createScene({ hearing: { panning: 7 } })",
                 "new carillon.Trace().step(0, { contacts: [{ object: 1, point: [0, 0, 0] }] })",
                 "new carillon.Trace({ frame: 'world' })")
        for i, text in enumerate(wrong):
            (self.folder / f"wrong{i}.ts").write_text(
                f"import * as carillon from 'carillon'; const c = carillon.connect(); {text};")
        _, said = run("node", MODULES / "typescript/bin/tsc", "--noEmit", "--strict", "--target", "es2022", "--module",
                      "node16", "--types", "node", *sorted(self.folder.glob("*.ts")), cwd=self.folder)
        faults = re.findall(r"(?m)^(\S+)\(\d+,\d+\): error", said)
        self.assertEqual(sorted(set(faults)), [f"wrong{i}.ts" for i in range(len(wrong))], said)
