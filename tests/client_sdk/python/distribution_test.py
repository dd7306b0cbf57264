# SPDX-License-Identifier: Apache-2.0
"""The Python package as it is distributed: a wheel, a source distribution that builds alone, and its types."""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
BUILT = pathlib.Path(os.environ["CARILLON_BUILD_DIR"]) / "client_sdk/python"


def run(*words, **options):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False, **options)
    if done.returncode:
        raise AssertionError(f"{words}: {done.stdout}{done.stderr}")
    return done.stdout


def pip(*words):
    return run(sys.executable, "-m", "pip", "--disable-pip-version-check", *words)


class DistributionTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        # Setuptools writes beside its sources.
        for name in ("client_sdk/python", "proto"):
            run("mkdir", "-p", (self.folder / "tree" / name).parent)
            run("cp", "-r", ROOT / name, self.folder / "tree" / name)
        self.project = self.folder / "tree/client_sdk/python"

    def wheel_of(self, project):
        pip("wheel", "--quiet", "--no-build-isolation", "--no-deps", "--no-index", "--wheel-dir", self.folder, project)
        (wheel,) = self.folder.glob("*.whl")
        return wheel

    def test_a_folder_becomes_a_wheel_that_works_alone(self):
        wheel = self.wheel_of(self.project)
        self.assertRegex(wheel.name, "-py3-none-any")  # for every system
        names = zipfile.ZipFile(wheel).namelist()
        for name in ("carillon/py.typed", "carillon/v1/contact_pb2.py", "carillon/v1/contact_pb2.pyi",
                     "carillon/v1/contact_service_pb2_grpc.py"):
            self.assertIn(name, names)
        target = self.folder / "target"
        pip("install", "--quiet", "--no-deps", "--no-index", "--target", target, wheel)
        said = run(sys.executable, "-c", "import carillon; print(carillon.__file__, carillon.__version__)", cwd=target,
                   env={**os.environ, "PYTHONPATH": str(target)})
        version = re.search(r"project\(carillon VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
        self.assertEqual(said.split(), [str(target / "carillon/__init__.py"), version])

    def test_a_source_distribution_builds_without_the_checkout(self):
        run(sys.executable, "setup.py", "--quiet", "sdist", "--dist-dir", self.folder, cwd=self.project)
        (archive,) = self.folder.glob("*.tar.gz")
        run("rm", "-r", self.folder / "tree")
        self.assertIn("carillon/v1/contact_pb2.py", zipfile.ZipFile(self.wheel_of(archive)).namelist())

    def test_a_build_without_a_generator_or_without_the_contract_says_what_to_do(self):
        for name, expected in (("grpc_python_plugin", "Install Debian's protobuf-compiler and protobuf-compiler-grpc"),
                               ("the contract", "Build the package from a checkout")):
            if name == "the contract":
                run("rm", "-r", self.folder / "tree/proto")
            # Neither protoc nor its plugin is in this PATH.
            done = subprocess.run([sys.executable, "setup.py", "build_py"], cwd=self.project, env={"PATH": "/nowhere"},
                                  capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 1)
            self.assertIn(expected, done.stderr)
            self.assertNotIn("Traceback", done.stderr)

    def test_types_are_right(self):
        run("mypy", "--config-file", pathlib.Path(__file__).with_name("mypy.ini"), "--cache-dir", self.folder / "cache",
            "carillon", cwd=BUILT)
