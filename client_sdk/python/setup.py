# SPDX-License-Identifier: Apache-2.0
"""Generates carillon.v1 from the contract when the package is built: by protoc and grpc_python_plugin (Debian's
protobuf-compiler and protobuf-compiler-grpc), or, where those are missing, by grpcio-tools. A checkout has the contract
in ../../proto, a source distribution in proto/."""

import importlib.util
import pathlib
import shutil
import subprocess
import sys

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

HERE = pathlib.Path(__file__).resolve().parent
OWN_CONTRACT = HERE / "proto"
CONTRACT = OWN_CONTRACT if OWN_CONTRACT.is_dir() else HERE.parents[1] / "proto"


def generator():
    """The words of the command that generates code, without its files."""
    plugin = shutil.which("grpc_python_plugin")
    if shutil.which("protoc") and plugin:
        return ["protoc", f"--plugin=protoc-gen-grpc_python={plugin}"]
    if importlib.util.find_spec("grpc_tools") is None:
        raise SystemExit("carillon: nothing here generates code from the contract. Install Debian's protobuf-compiler "
                         "and protobuf-compiler-grpc; or run \"pip install grpcio-tools setuptools wheel\", and give "
                         "pip --no-build-isolation, so that it finds them.")
    return [sys.executable, "-m", "grpc_tools.protoc"]


def generate(folder):
    """Writes carillon/v1 into the folder, with stubs for type checkers."""
    files = sorted((CONTRACT / "carillon/v1").glob("*.proto"))
    if not files:
        raise SystemExit(f"carillon: {CONTRACT} has no contract. Build the package from a checkout of the project, or "
                         "from a source distribution.")
    subprocess.run([*generator(), f"-I{CONTRACT}", f"--python_out={folder}", f"--pyi_out={folder}",
                    f"--grpc_python_out={folder}", *map(str, files)], check=True)
    (pathlib.Path(folder) / "carillon/v1/__init__.py").touch()


class BuildWithContract(build_py):
    """Adds the generated code to what is built."""

    def run(self):
        super().run()
        generate(self.build_lib)


class SdistWithContract(sdist):
    """Adds the contract to what is distributed, so that the distribution can be built alone."""

    def make_release_tree(self, base_dir, files):
        super().make_release_tree(base_dir, files)
        target = pathlib.Path(base_dir) / "proto/carillon/v1"
        target.mkdir(parents=True, exist_ok=True)
        for file in (CONTRACT / "carillon/v1").glob("*.proto"):
            shutil.copy(file, target)


setup(cmdclass={"build_py": BuildWithContract, "sdist": SdistWithContract})
